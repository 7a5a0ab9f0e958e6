"""Natural policy gradient on many robots at once, with DAPG and SOIL by one hook; numpy only."""
