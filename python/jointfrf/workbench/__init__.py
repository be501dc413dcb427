"""What is done with the core: command line, pages, cases, studies, plans, pools, levels, assembly files, FE matrices.

The core (all other packages of `jointfrf`) does not import the workbench. In reading order, each above the former:

fe             matrices, nodes and modes of FE programs
solids         solid bodies of eight-node bricks
structures     structures as tables of TOML
amplitude      joints over amplitude: levels, free decays, friction laws
planning       which channels and lines a test needs
pooling        one joint in several assemblies
report         tables, figures and pages
assembly_file  `assembly.toml`: parts, joints and a measured file
cases          published cases and those of users
studies        many cases in one design
cli            the command line
"""
