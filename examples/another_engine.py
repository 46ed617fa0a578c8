"""Compare engines on scenes of known outcome: MuJoCo, if it is installed, and the rigid reference.

Run it: python examples/another_engine.py
"""

from verification.engines import compare_engines, verdict

for record in compare_engines(["mujoco", "rigid"], ["elastic_cradle", "redundant_wedge"]):
    print(f"{record.engine:<8} {record.scene:<16} settings: {record.choice:<8} {verdict(record)}")
