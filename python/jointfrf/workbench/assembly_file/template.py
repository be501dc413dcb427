"""Template of `assembly.toml`."""

from __future__ import annotations

__all__ = ["TEMPLATE"]

#: Two parts of beams, a joint, a sensor; in comments parts of files of an FE program, and more parts than two.
TEMPLATE = """\
#:schema ./assembly.schema.json
# Two parts, the joint between them, what is unknown, and which channel of a test is which DOF. SI units.
# All keys: docs/assembly-keys.md. Then: jointfrf identify TEST.uff --model assembly.toml

[A]                                 # side j of the joint
model = "beam"                      # or chain, brick-beam, rigid-body, matrices, modes, receptances
length = 0.3                        # m
elements = 12
ends = ["clamped", "free"]
youngs_modulus = 70e9               # N/m^2
density = 2700.0                    # kg/m^3
width = 0.025                       # m
height = 0.006                      # m, in the plane of bending
loss_factor = 0.005
joint = ["13:y", "13:theta"]        # its DOFs at the joint, in the order of those of the joint
unknown = { youngs_modulus = 0.02 } # known to 2 %; fitted with the joint

[B]                                 # side k
model = "beam"
length = 0.225
elements = 9
youngs_modulus = 70e9
density = 2700.0
width = 0.025
height = 0.006
loss_factor = 0.005
joint = ["1:y", "1:theta"]

# A part of a finite-element program, here of CalculiX (*FREQUENCY, SOLVER=MATRIXSTORAGE):
#
# [B]
# model = "matrices"
# stiffness = "b.sti"               # or Abaqus .mtx, Nastran .pch .op2 .op4, Ansys .full, .mtx, .npz
# mass = "b.mas"
# nodes = "b.inp"                   # where the nodes are
# units = "mm-t-s"                  # of these files
# loss_factor = 0.005
# joint = ["bolt:y", "bolt:theta_z"]
#
# [[B.point]]                       # a reference point of the nodes around the bolt
# name = "bolt"
# set = "BOLT"                      # *NSET of b.inp; or nodes = [11, 12, 13], or box = [x, y, z, x, y, z]
# coupling = "distributing"         # RBE3; or "rigid", RBE2

# A part whose modes or FRFs were measured:
#
# [B]
# model = "modes"                   # or "receptances", with file = "part.uff"
# file = "part_modes.uff"           # dataset 55; or .npz of sdypy-EMA, pyOMA2 with modal masses, scripts
# residuals = "part.uff"            # FRFs of the part, for the modes that are not in the file
# joint = ["1:y", "1:theta_z"]

[[joint.law]]
dof = "y"
law = "spring"                      # or standard-linear-solid, fractional-zener, power, rigid

[[joint.law]]
dof = "theta_z"
law = "spring"

[channels]                          # channel of the file = DOF; -y where it points the other way
"1:+y" = "A/7:y"
"2:+y" = "A/@0.225,0,0:y"           # the nearest node to a position, m
"3:+y" = "B/10:y"

[[mass]]                            # a sensor
dofs = ["B/10:y"]
mass = 0.003                        # kg
unknown = 0.2                       # known to 20 %

# More parts and joints than two and one have names, in place of [A], [B] and [joint]:
#
# same = ["left", "right"]          # equal; or [alike.mounts] with joints = [...]: a common mean with a spread
#
# [parts.machine]
# model = "rigid-body"              # or any of the others; without joint
# mass = 60.0                       # kg
# inertia = [2.2, 3.0, 3.6]         # kg m^2
# points = { left = [-0.3, 0.0, -0.2], right = [0.3, 0.0, -0.2] }  # m
# moves = ["z", "theta_y"]
#
# [joints.left]
# j = ["machine/left:z"]            # k = ["frame/3:z"]: the other side; without it the ground
#
# [[joints.left.law]]
# dof = "z"
# law = "spring"
#
# [joints.right]
# j = ["machine/right:z"]
#
# [[joints.right.law]]
# dof = "z"
# law = "spring"
"""
