"""The commands of `revolver-lab`, a module for each thing one does with a robot."""
