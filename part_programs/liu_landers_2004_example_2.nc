(Example 2: force control. A taper on which the depth of cut falls from 2 mm to 0)
(Source: J. Liu, R. G. Landers, Integrated Modular Machine Tool Simulation for Education)
(in Manufacturing Automation, Int. J. Eng. Educ. 20, 2004, section Example 2; the moves are)
(put together from its text, since no program is printed)
(Stock: radius 17 mm, face at Z15. X is a radius; F120 at S1000 is 0.12 mm per revolution)
N10 G90 G94 G71
N20 M03 S1000
N30 G00 X15.0 Z10.0
N40 G01 Z15.0 F120
N50 X17.0 Z35.0
N60 G00 X20.0 Z0.0
N70 X0.0
N80 M05
N90 M30
