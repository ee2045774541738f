"""The slow flow of a viscous fluid through a matrix of bodies, solved on a grid."""
