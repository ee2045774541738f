"""Analyses of a finished search: confidence intervals of the genes, and their effect on the objectives."""
