"""How it runs: a CasADi graph becomes machine code and is integrated by Rodas4. Knows nothing of hydraulics."""
