"""From measured channels to the DOFs of the joint: points along a line, differences, virtual points, consistency."""
