"""The arm and its controller in two processes, which exchange messages over LCM."""
