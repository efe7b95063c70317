"""How it moves: the laws of each part, written once as CasADi expressions, and circuits made of parts."""
