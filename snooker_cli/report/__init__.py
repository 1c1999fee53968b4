"""Reproduction of the source report: its printed values, their audit, and our own report.

Source report: "Effect of Coefficient of Restitution on Thermodynamic Properties - a 2D Simulation".
"""
