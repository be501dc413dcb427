"""From measured channels to the DOFs of the joint.

point_lines     points along lines: differences
extent          how far apart points of a side may be
virtual_point   virtual points, and how far channels agree with rigid motion
joint_channels  all channels around a joint, DOFs left out
check/          what is wrong with measured FRFs
"""
