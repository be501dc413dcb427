"""Laws of joints: K*(w) of a DOF from a few parameters, and joints composed of them.

law           base class of laws: K*(w), its derivatives, parameters with units and bounds, initial values, files
springs       springs with viscous and hysteretic damping
viscoelastic  rubber and polymers: standard linear solid, fractional Zener, power law
function_law  a user-defined law: a function with its derivatives
law_joint     a joint of laws by DOF, cross terms, masses, rigid DOFs; as input of finite-element programs
words         names of laws in files
joint_toml    joints in TOML files
"""
