(dialect: linuxcnc)
(Taper: straight passes in a loop and a finishing pass)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G90 G95 G7
T1 M6
G96 S180 D2500 M3
O100 SUB (diameter, end)
G0 X#1
G1 Z#2 F0.25
X44
G0 Z2
O100 ENDSUB
G0 X44 Z2
O100 CALL [40] [-30]
O100 CALL [36] [-24]
O100 CALL [32] [-16]
G0 X28 Z2
G1 Z0 F0.1
X40 Z-30
X44
G0 X60 Z30
M30
