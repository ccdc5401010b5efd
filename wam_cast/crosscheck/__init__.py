"""The judge: the same casts in MuJoCo, from the scenario's numbers alone, and how far the engines are from each other."""
