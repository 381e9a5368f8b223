"""Reactive layers under the motor programs: what is near, being stuck, backing away."""
