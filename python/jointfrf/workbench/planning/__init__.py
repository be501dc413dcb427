"""Plans of tests: information of sensors and impacts on a joint, their choice, and the number of assemblies.

information   Fisher information of FRFs that have not been measured, from models
design        choice of sensors and impacts: greedy, then by exchange
plan          `plan`: the public function
joint_frfs    `plan_joint_frfs`: FRFs between all joint DOFs, without models
assemblies    number of assemblies for a wanted prediction interval
"""
