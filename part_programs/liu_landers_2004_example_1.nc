(Example 1: servo control. A straight cut at radius 15 mm, a taper, and out of the part)
(Source: J. Liu, R. G. Landers, Integrated Modular Machine Tool Simulation for Education)
(in Manufacturing Automation, Int. J. Eng. Educ. 20, 2004, section Example 1)
(Stock: radius 18 mm, length 60 mm, face at Z15. X is a radius; the tool cuts toward +Z)
(As printed there: M00 is meant as spindle stop, and no M30 closes the program)
N10 G90 G94 G71
N20 G00 X15.0 Z10.0
N30 M03 G01 Z30.0 F120 S1000
N40 X17.0 Z40.0 F180
N50 Z50.0
N60 X20.0
N70 M00 G00 Z0.0
N80 X0.0
