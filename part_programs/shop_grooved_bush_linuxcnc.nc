(dialect: linuxcnc)
(Bush with a groove: turned, then grooved in a loop)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G90 G95 G7
T1 M6
G96 S150 D2500 M3
O100 SUB
G0 X34
G1 Z0
X36 Z-1
Z-30
X42
O100 ENDSUB
G0 X42 Z2
F0.25
G71 Q100 D0.1 I2 R0.5
F0.12
G70 Q100 X42 Z2
G0 X44 Z-12
F0.08
#<place> = -12
O200 WHILE [#<place> GE -16]
  G0 Z#<place>
  #<x> = 44
  O210 WHILE [#<x> GT 28]
    #<x> = [#<x> - 3]
    O220 IF [#<x> LT 28]
      #<x> = 28
    O220 ENDIF
    G1 X#<x>
    G0 X[#<x> + 0.6]
  O210 ENDWHILE
  G0 X44
  O230 IF [#<place> EQ -15]
    #<place> = -16
  O230 ELSE
    #<place> = [#<place> - 1.5]
  O230 ENDIF
O200 ENDWHILE
(the bottom and both walls, in one pass)
G0 Z-12
G1 X28 F0.06
Z-16
X44
G0 X60 Z30
M30
