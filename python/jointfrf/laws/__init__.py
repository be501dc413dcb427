"""Laws of joints: K*(w) of a DOF from a few parameters, and joints put together from them.

law           what a law is: its parameters with units and bounds, K*(w) and its derivatives, values to start from
springs       springs with viscous and hysteretic damping
viscoelastic  rubber and polymers: standard linear solid, fractional Zener, power law
function_law  a law of one's own
law_joint     a joint of laws by DOF, cross terms, masses, rigid DOFs
law_table     laws by their word in TOML files
joint_toml    joints in TOML files
joint_cards   what finite-element programs can be given of it
"""
