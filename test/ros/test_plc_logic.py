"""The PLC's scan by itself."""

from conveyor_sim.ros.plc_logic import PlcMemory, PlcSettings, scan

SETTINGS = PlcSettings("in", "table", high_mark=45, low_mark=35, feeder_speed=1.0, table_slow=0.2, table_fast=0.3)


def feeder_speeds(counts: list[int]) -> list[float]:
    """Of the scans that see so many bottles on the table."""
    speeds, memory = [], PlcMemory()
    for count in counts:
        setpoints, memory = scan({"belts/table/bottles": count}, SETTINGS, memory)
        speeds.append(setpoints["belts/in/cmd_speed"])
    return speeds


def test_the_feeder_is_held_from_the_high_mark_until_the_low_mark() -> None:
    assert feeder_speeds([0, 44, 45, 44, 36, 35, 36, 44, 46]) == [1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0]


def test_the_table_runs_fast_up_to_the_low_mark() -> None:
    for count, speed in ((0, 0.3), (35, 0.3), (36, 0.2), (99, 0.2)):
        setpoints, _ = scan({"belts/table/bottles": count}, SETTINGS, PlcMemory())
        assert setpoints["belts/table/cmd_speed"] == speed
