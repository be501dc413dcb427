"""Before a test: what sensors and hits will know of a joint, which to choose, and how many assemblies to test.

information   Fisher information of FRFs that have not been measured, from models
design        sensors and hits by greedy choice and exchange
plan          `plan`: the door
joint_frfs    `plan_joint_frfs`: FRFs between all joint DOFs, without models
assemblies    how many assemblies an interval of the next one needs
"""
