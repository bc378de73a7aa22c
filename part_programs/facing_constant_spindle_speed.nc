(Facing at a constant spindle speed of 1000 rpm: the cutting speed falls to nothing toward the centre)
(Stock: radius 18 mm, face at Z15. X is a radius; 1 mm is taken off the face)
N10 G90 G95 G71 G18
N20 G97 S1000 M03
N30 G00 X20.0 Z16.0
N40 G01 X2.0 F0.15
N50 Z14.0
N60 G00 X20.0
N70 Z0.0
N80 X0.0 M05
N90 M30
