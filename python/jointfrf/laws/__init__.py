"""Laws of joints: K*(w) of a DOF from a few parameters, and joints put together from them.

law           what a law is: K*(w), its derivatives, its parameters with units and bounds, initial values, files
springs       springs with viscous and hysteretic damping
viscoelastic  rubber and polymers: standard linear solid, fractional Zener, power law
function_law  a user-defined law: a function with its derivatives
law_joint     a joint of laws by DOF, cross terms, masses, rigid DOFs; as input of finite-element programs
words         the laws that files can hold, by their words
joint_toml    joints in TOML files
"""
