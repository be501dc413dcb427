"""A joint of laws from FRFs between all joint DOFs, without models: the fit on the manifold with other coordinates.

law_coordinates  compliance of a joint of laws, and its derivatives
form_squares     squares of the fit about its minimum, for profiles
fit              every group of DOFs fitted, and put together
describe         notes and warnings
law_fit          the result
identify_laws    the door: `identify` with a joint of laws
"""
