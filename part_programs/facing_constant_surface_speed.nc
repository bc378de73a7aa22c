(Facing at a constant surface speed of 150 m/min: the spindle speeds up toward the centre)
(Stock: radius 18 mm, face at Z15. X is a radius; 1 mm is taken off the face)
(The cut ends at X2, where 150 m/min asks for some 12000 rpm; real spindles run into their limit before)
N10 G90 G95 G71 G18
N20 G96 S150 M03
N30 G00 X20.0 Z16.0
N40 G01 X2.0 F0.15
N50 Z14.0
N60 G00 X20.0
(Back to a constant speed before the way home)
N70 G97 S1000
N80 G00 Z0.0
N90 X0.0 M05
N100 M30
