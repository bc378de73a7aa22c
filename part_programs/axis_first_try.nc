(A first try at telling play from friction: three long strokes at one speed)
(X is a radius; no stock is meant)
N10 G90 G94 G71 G18
N20 G01 X20.0 F1200
N30 X0.0
N40 X20.0
N50 X0.0
N60 X20.0
N70 X0.0
N80 M30
