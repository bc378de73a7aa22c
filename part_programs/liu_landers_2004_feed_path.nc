(The feed moves of Example 1 alone, from X15 Z10 on: a straight cut, a taper, and out of the part)
(Source: J. Liu, R. G. Landers, Integrated Modular Machine Tool Simulation for Education)
(in Manufacturing Automation, Int. J. Eng. Educ. 20, 2004, section Example 1)
(X is a radius; the tool cuts toward +Z)
N10 G90 G94 G71
N30 M03 G01 Z30.0 F120 S1000
N40 X17.0 Z40.0 F180
N50 Z50.0
N60 X20.0
N70 M00
