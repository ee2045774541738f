"""Parts that several cases share: two spheres in closed form, the fluids of L21, the fibre of B16, rubble
piles, runs from several starts, and CSV tables."""
