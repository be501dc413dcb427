"""Laws of joints: K*(w) of a DOF from a few parameters, and joints put together from them.

law           what a law is: its parameters with units and bounds, K*(w) and its derivatives, initial values
springs       springs with viscous and hysteretic damping
viscoelastic  rubber and polymers: standard linear solid, fractional Zener, power law
function_law  a user-defined law: a function with its derivatives
law_joint     a joint of laws by DOF, cross terms, masses, rigid DOFs
law_table     laws by their word in TOML files
joint_toml    joints in TOML files
joint_cards   a joint of laws as input of finite-element programs
"""
