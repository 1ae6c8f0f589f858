"""Features of a bound feature file: values, limits, access, and what is remembered."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from register_files import MemoryRegisters, node_map, register

from fieldcam.camera.genapi import Access, NodeMap, load_feature_file
from fieldcam.errors import (
    CameraUnplugged,
    FeatureFileInvalid,
    FeatureMissing,
    FeatureRefused,
)


def constant(name: str, value: int | float, *extra: str, tag: str = "Integer") -> str:
    return f'<{tag} Name="{name}"><Value>{value}</Value>{"".join(extra)}</{tag}>'


def counting() -> MemoryRegisters:
    """Byte n holds n."""
    return MemoryRegisters(bytearray(range(256)))


@pytest.mark.parametrize(
    ("settings", "value"),
    [
        ({}, 0x13121110),
        ({"Endianess": "BigEndian"}, 0x10111213),
        ({"Length": 3}, 0x121110),
        ({"Length": 8, "Endianess": "BigEndian"}, 0x1011121314151617),
        ({"Address": 0xF0, "Length": 1, "Sign": "Signed"}, -16),
        ({"tag": "MaskedIntReg", "LSB": 4, "MSB": 11}, 0x11),
        ({"tag": "MaskedIntReg", "LSB": 11, "MSB": 4}, 0x11),
        ({"tag": "MaskedIntReg", "Bit": 4}, 1),
        ({"tag": "MaskedIntReg", "Bit": 3, "Endianess": "BigEndian"}, 1),
        ({"tag": "MaskedIntReg", "LSB": 31, "MSB": 24, "Endianess": "BigEndian"}, 0x13),
        ({"tag": "MaskedIntReg", "LSB": 11, "MSB": 4, "Endianess": "BigEndian"}, 0x01),
        ({"tag": "MaskedIntReg", "LSB": 4, "MSB": 4, "Sign": "Signed"}, -1),
    ],
)
def test_registers_are_read_in_both_byte_orders(settings: dict[str, str | int], value: int) -> None:
    """The expected values were cross-checked with the standard's reference implementation."""
    tag = str(settings.pop("tag", "IntReg"))
    features = node_map(register("X", 0x10, tag=tag, **settings), registers=counting())
    assert features.integer("X").value == value


@given(
    length=st.integers(1, 8),
    bits=st.tuples(st.integers(0, 63), st.integers(0, 63)),
    order=st.sampled_from(["BigEndian", "LittleEndian"]),
    sign=st.sampled_from(["Signed", "Unsigned"]),
    data=st.data(),
)
def test_what_is_written_to_some_bits_is_read_back_and_leaves_the_others(
    length: int, bits: tuple[int, int], order: str, sign: str, data: st.DataObject
) -> None:
    lsb, msb = (bit % (8 * length) for bit in bits)
    memory = bytearray(data.draw(st.binary(min_size=8, max_size=8)))
    settings: dict[str, str | int] = {
        "Length": length,
        "LSB": lsb,
        "MSB": msb,
        "Endianess": order,
        "Sign": sign,
    }
    before = bytes(memory)
    features = node_map(
        register("X", 0, tag="MaskedIntReg", **settings), registers=MemoryRegisters(memory)
    )
    field = features.integer("X")
    original = field.value
    field.value = value = data.draw(st.integers(field.min, field.max))
    assert field.value == value
    field.value = original
    assert bytes(memory) == before


@pytest.mark.parametrize(("length", "layout"), [(4, "f"), (8, "d")])
@pytest.mark.parametrize(("order", "prefix"), [("BigEndian", ">"), ("LittleEndian", "<")])
def test_float_registers(length: int, layout: str, order: str, prefix: str) -> None:
    registers = MemoryRegisters()
    features = node_map(
        register("X", 8, tag="FloatReg", Length=length, Endianess=order), registers=registers
    )
    features.floating("X").value = -2.5
    assert registers.memory[8 : 8 + length] == struct.pack(prefix + layout, -2.5)
    assert features.floating("X").value == -2.5


def test_text_registers() -> None:
    registers = MemoryRegisters()
    features = node_map(
        register("Id", 8, tag="StringReg", Length=8),
        '<String Name="Name"><pValue>Id</pValue></String>',
        registers=registers,
    )
    features.string("Name").value = "left"
    assert bytes(registers.memory[8:16]) == b"left\0\0\0\0"
    assert features.string("Id").value == "left"
    with pytest.raises(FeatureRefused, match="at most 8 bytes"):
        features.string("Name").value = "much too long"


@pytest.mark.parametrize(
    ("places", "address"),
    [
        ("<pAddress>Base</pAddress>", 0x22),
        ('<pIndex Offset="8">Index</pIndex>', 0x20),
        ("<pIndex>Index</pIndex>", 0x18),
        ('<pIndex pOffset="Base">Index</pIndex>', 0x34),
        ("<Address>1</Address><IntSwissKnife><Formula>4*4</Formula></IntSwissKnife>", 0x21),
    ],
)
def test_an_address_is_the_sum_of_its_parts(places: str, address: int) -> None:
    features = node_map(
        constant("Base", 0x12),
        constant("Index", 2),
        register("X", 0x10, places),
        register("Table", 0x10, places, tag="Register"),
        registers=counting(),
    )
    assert features.integer("X").value & 0xFF == address
    assert features.register("Table").address == address
    assert features.register("Table").value == bytes(range(address, address + 4))


WIDTH = (
    '<Integer Name="Width"><pValue>WidthReg</pValue><Min>16</Min><pMax>Limit</pMax><Inc>4</Inc>'
    "<Unit>px</Unit></Integer>",
    register("WidthReg", 0),
    constant("Limit", 64),
)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (12, "Width cannot be 12: it takes 16 to 64 in steps of 4 px."),
        (68, "16 to 64 in steps of 4 px"),
        (18, "in steps of 4"),
        (True, "whole numbers"),
        (20.0, "whole numbers"),
    ],
)
def test_an_integer_outside_its_range_is_refused(value: int, words: str) -> None:
    features = node_map(*WIDTH)
    with pytest.raises(FeatureRefused, match=words):
        features.integer("Width").value = value
    features.integer("Width").value = 20
    assert features.integer("WidthReg").value == 20


def test_a_list_of_values_is_all_that_is_allowed() -> None:
    features = node_map(constant("X", 3, "<ValidValueSet>1;3;9</ValidValueSet>"))
    with pytest.raises(FeatureRefused, match=r"1, 3, 9\."):
        features.integer("X").value = 4
    features.integer("X").value = 9
    assert features.integer("X").value == 9


def test_floats_are_bounded_and_not_held_to_their_increment() -> None:
    features = node_map(
        constant("X", 5.5, "<Min>1</Min><Max>9</Max><Inc>0.5</Inc><Unit>us</Unit>", tag="Float")
    )
    exposure = features.floating("X")
    exposure.value = 5.7
    assert (exposure.value, exposure.increment) == (5.7, 0.5)
    for value in (0.5, 9.5, float("nan"), float("inf")):
        with pytest.raises(FeatureRefused):
            exposure.value = value


def test_a_converter_shows_a_register_in_other_units() -> None:
    features = node_map(
        register("Raw", 0, Length=1),
        constant("Scale", 4),
        '<Converter Name="Gain"><pVariable Name="S">Scale</pVariable>'
        "<FormulaTo>FROM*S</FormulaTo><FormulaFrom>TO/S</FormulaFrom><pValue>Raw</pValue>"
        "<Slope>Increasing</Slope></Converter>",
        '<IntConverter Name="Half"><FormulaTo>FROM*-2</FormulaTo><FormulaFrom>TO/-2</FormulaFrom>'
        "<pValue>Raw</pValue></IntConverter>",
        '<Converter Name="Period"><FormulaTo>1000/FROM</FormulaTo>'
        "<FormulaFrom>1000/TO</FormulaFrom><pValue>Raw</pValue></Converter>",
    )
    gain = features.floating("Gain")
    gain.value = 2.5
    assert features.integer("Raw").value == 10
    assert (gain.min, gain.max) == (0, 63.75)
    assert features.integer("Half").value == -5
    assert (features.integer("Half").min, features.integer("Half").max) == (-127, 0)
    features.floating("Period").value = 100
    assert features.integer("Raw").value == 10


def test_variables_may_name_a_property_of_their_node() -> None:
    knife = '<IntSwissKnife Name="{}"><pVariable Name="{}">{}</pVariable><Formula>{}</Formula>'
    cases = [
        ("W.Min", "Width", "W.Min", 16),
        ("W.Inc", "Width", "W.Inc*2", 8),
        ("W", "Width", "W.Max", 64),
        ("W.Value", "Limit", "W.Value", 64),
        ("E.Entry.On", "Mode", "E.Entry.On", 7),
        ("E.Enum.On", "Mode", "E.Enum.On", 7),
        ("E", "Mode", "E", 3),
    ]
    nodes = [
        knife.format(f"K{i}", name, node, formula) + "</IntSwissKnife>"
        for i, (name, node, formula, _) in enumerate(cases)
    ]
    features = node_map(*WIDTH, *nodes, MODE)
    found = [features.integer(f"K{i}").value for i in range(len(cases))]
    assert found == [value for *_, value in cases]


MODE = (
    '<Enumeration Name="Mode"><EnumEntry Name="Off"><Value>3</Value></EnumEntry>'
    '<EnumEntry Name="On"><Value>7</Value></EnumEntry>'
    '<EnumEntry Name="Auto"><pIsAvailable>HasAuto</pIsAvailable><Value>9</Value></EnumEntry>'
    "<Value>3</Value></Enumeration>" + constant("HasAuto", 0)
)


def test_an_enumeration_takes_what_is_available() -> None:
    features = node_map(MODE)
    mode = features.enumeration("Mode")
    mode.value = "On"
    assert (mode.value, mode.chosen.code, mode.symbols) == ("On", 7, ("Off", "On"))
    with pytest.raises(FeatureRefused, match=r"Mode cannot be 'Auto': it takes Off, On\."):
        mode.value = "Auto"
    features.integer("HasAuto").value = 1
    mode.value = "Auto"
    assert mode.number() == 9


def test_an_enumeration_says_what_the_camera_holds_instead() -> None:
    features = node_map(
        '<Enumeration Name="Mode"><EnumEntry Name="Off"><Value>3</Value></EnumEntry>'
        "<pValue>R</pValue></Enumeration>",
        register("R", 0x10, Length=1),
        registers=counting(),
    )
    with pytest.raises(FeatureRefused, match="holds 16"):
        _ = features.enumeration("Mode").value


def test_a_boolean_has_its_own_numbers() -> None:
    features = node_map(
        '<Boolean Name="On"><pValue>R</pValue><OnValue>5</OnValue><OffValue>2</OffValue></Boolean>',
        register("R", 0),
    )
    with pytest.raises(FeatureRefused, match="neither on nor off"):
        _ = features.boolean("On").value
    features.boolean("On").value = True
    assert features.integer("R").value == 5
    features.boolean("On").value = False
    assert features.integer("R").value == 2
    assert features.boolean("On").value is False


class Finishing(MemoryRegisters):
    """A camera that clears a command's register after it was looked at twice."""

    def read(self, address: int, length: int) -> bytes:
        data = super().read(address, length)
        if len(self.reads) == 2:
            self.memory[address] = 0
        return data


def test_a_command_is_polled_until_it_is_done() -> None:
    registers = Finishing()
    features = node_map(
        '<Command Name="Go"><pValue>R</pValue><CommandValue>7</CommandValue>'
        "<PollingTime>1</PollingTime></Command>",
        register("R", 0),
        registers=registers,
    )
    features.command("Go").run(deadline_s=5)
    assert len(registers.reads) == 3
    features.command("Go").execute()
    assert registers.memory[0] == 7
    with pytest.raises(FeatureRefused, match="not done within"):
        features.command("Go").run(deadline_s=0)


def test_a_command_that_cannot_be_read_is_done() -> None:
    features = node_map(
        '<Command Name="Go"><pValue>R</pValue></Command>', register("R", 0, AccessMode="WO")
    )
    features.command("Go").run(deadline_s=0)
    assert features.command("Go").access is Access.WRITE_ONLY


@pytest.mark.parametrize(
    ("conditions", "declared", "access"),
    [
        ("", "RW", Access.READ_WRITE),
        ("", "RO", Access.READ_ONLY),
        ("<ImposedAccessMode>RO</ImposedAccessMode>", "RW", Access.READ_ONLY),
        ("<ImposedAccessMode>WO</ImposedAccessMode>", "RW", Access.WRITE_ONLY),
        ("<ImposedAccessMode>WO</ImposedAccessMode>", "RO", Access.NOT_AVAILABLE),
        ("<pIsImplemented>Zero</pIsImplemented>", "RW", Access.NOT_IMPLEMENTED),
        ("<pIsAvailable>Zero</pIsAvailable>", "RW", Access.NOT_AVAILABLE),
        ("<pIsLocked>One</pIsLocked>", "RW", Access.READ_ONLY),
        ("<pIsLocked>One</pIsLocked>", "WO", Access.NOT_AVAILABLE),
        ("<pIsImplemented>One</pIsImplemented><pIsLocked>Zero</pIsLocked>", "RW", "RW"),
    ],
)
def test_access_is_what_all_conditions_leave(
    conditions: str, declared: str, access: Access
) -> None:
    features = node_map(
        constant("Zero", 0),
        constant("One", 1),
        register("R", 0, AccessMode=declared),
        f'<Integer Name="X">{conditions}<pValue>R</pValue></Integer>',
    )
    feature = features.integer("X")
    assert feature.access == access
    assert feature.conditional == ("pIs" in conditions)
    if not feature.readable:
        with pytest.raises(FeatureRefused, match="cannot be read"):
            _ = feature.value
    if not feature.writable:
        with pytest.raises(FeatureRefused, match="cannot be set"):
            feature.value = 1


def test_a_formula_over_what_is_not_there_is_not_available() -> None:
    features = node_map(
        constant("Zero", 0),
        constant("Gone", 5, "<pIsAvailable>Zero</pIsAvailable>"),
        '<IntSwissKnife Name="K"><pVariable Name="G">Gone</pVariable><Formula>G</Formula>'
        "</IntSwissKnife>",
    )
    assert features["K"].access is Access.NOT_AVAILABLE


def test_one_read_serves_all_flags_of_a_register() -> None:
    registers = MemoryRegisters()
    flags = [register(f"F{i}", 4, tag="MaskedIntReg", Bit=i) for i in range(32)]
    features = node_map(*flags, registers=registers)
    assert [features.integer(f"F{i}").value for i in range(32)] == [0] * 32
    assert registers.reads == [4]
    features.integer("F3").value = 1
    assert features.integer("F4").value == 0
    assert features.integer("F3").value == 1


@pytest.mark.parametrize(
    ("caching", "reads"), [("WriteThrough", 1), ("WriteAround", 2), ("NoCache", 3)]
)
def test_caching_is_as_declared(caching: str, reads: int) -> None:
    registers = MemoryRegisters()
    features = node_map(register("X", 0, Cachable=caching), registers=registers)
    feature = features.integer("X")
    assert feature.value == 0
    feature.value = 5
    assert (feature.value, feature.value) == (5, 5)
    assert len(registers.reads) == reads


def test_what_is_written_is_forgotten_wherever_it_was_read() -> None:
    registers = MemoryRegisters()
    features = node_map(register("Whole", 0), register("Part", 2, Length=1), registers=registers)
    assert features.integer("Whole").value == 0
    features.integer("Part").value = 0xAB
    assert features.integer("Whole").value == 0xAB0000


@pytest.mark.parametrize(
    "reference", ["<pInvalidator>Sel</pInvalidator>", "<pInvalidator>SelReg</pInvalidator>"]
)
def test_an_invalidator_makes_a_node_read_again(reference: str) -> None:
    registers = MemoryRegisters()
    features = node_map(
        '<Integer Name="Sel"><pValue>SelReg</pValue></Integer>',
        '<Integer Name="Other"><pValue>SelReg</pValue></Integer>',
        register("SelReg", 0),
        register("Gain", 8, reference),
        register("Calm", 12),
        '<Integer Name="Shown"><pValue>Gain</pValue></Integer>',
        registers=registers,
    )
    assert features.integer("Shown").value == features.integer("Calm").value == 0
    registers.memory[8] = registers.memory[12] = 5
    assert features.integer("Shown").value == 0
    features.integer("Other").value = 1
    assert features.integer("Shown").value == 5
    assert features.integer("Calm").value == 0


def test_a_selector_makes_what_it_selects_be_read_again() -> None:
    registers = MemoryRegisters()
    features = node_map(
        constant("Sel", 0, "<pSelected>Gain</pSelected>"),
        '<Integer Name="Gain"><pValue>GainReg</pValue></Integer>',
        register("GainReg", 8),
        registers=registers,
    )
    assert features.integer("Gain").value == 0
    registers.memory[8] = 5
    features.integer("Sel").value = 1
    assert features.integer("Gain").value == 5
    assert features.integer("Sel").selected == ("Gain",)


def test_refreshing_asks_the_camera_again() -> None:
    registers = MemoryRegisters()
    features = node_map(
        '<Integer Name="X"><pValue>R</pValue></Integer>', register("R", 0), registers=registers
    )
    assert features.integer("X").value == 0
    registers.memory[0] = 5
    features["X"].refresh()
    assert features.integer("X").value == 5


def test_a_polled_register_is_read_again_after_its_time() -> None:
    registers = MemoryRegisters()
    features = node_map(
        register("Now", 0, PollingTime=0),
        register("Later", 4, PollingTime=10**9),
        registers=registers,
    )
    assert features.integer("Now").value == features.integer("Later").value == 0
    registers.memory[0] = registers.memory[4] = 5
    assert (features.integer("Now").value, features.integer("Later").value) == (5, 0)


def test_an_index_chooses_among_values() -> None:
    features = node_map(
        constant("I", 1),
        constant("Else", 99),
        '<Integer Name="X"><pIndex>I</pIndex><ValueIndexed Index="1">11</ValueIndexed>'
        '<ValueIndexed Index="2">22</ValueIndexed><pValueDefault>Else</pValueDefault></Integer>',
    )
    found = []
    for index in (1, 2, 3):
        features.integer("I").value = index
        found.append(features.integer("X").value)
    assert found == [11, 22, 99]
    features.integer("X").value = 7
    assert features.integer("Else").value == 7


def test_a_value_is_copied_to_all_that_ask_for_it() -> None:
    features = node_map(
        '<Integer Name="X"><pValue>A</pValue><pValueCopy>B</pValueCopy></Integer>',
        register("A", 0),
        register("B", 4),
    )
    features.integer("X").value = 6
    assert features.integer("A").value == features.integer("B").value == 6


def test_entries_of_a_structure_are_registers() -> None:
    features = node_map(
        '<StructReg Name="S"><Address>0x10</Address><Length>4</Length><AccessMode>RW</AccessMode>'
        "<pPort>Device</pPort><Endianess>LittleEndian</Endianess>"
        '<StructEntry Name="Low"><LSB>0</LSB><MSB>7</MSB></StructEntry>'
        '<StructEntry Name="High"><AccessMode>RO</AccessMode><LSB>24</LSB><MSB>31</MSB>'
        "</StructEntry></StructReg>",
        registers=counting(),
    )
    assert (features.integer("Low").value, features.integer("High").value) == (0x10, 0x13)
    assert features["High"].access is Access.READ_ONLY
    assert features["Low"].access is Access.READ_WRITE


def test_what_only_an_image_brings_is_no_register() -> None:
    features = node_map(
        '<Port Name="Frame"><ChunkID>0504000A</ChunkID></Port>',
        register("FrameId", 2, pPort="Frame", Length=2),
        '<Integer Name="ChunkFrameID"><pValue>FrameId</pValue></Integer>',
    )
    assert features.integer("ChunkFrameID").access is Access.NOT_AVAILABLE


def test_an_address_that_is_no_whole_number_is_refused() -> None:
    huge = constant("Huge", 1e300, tag="Float")
    for place in ("<pAddress>Huge</pAddress>", "<pIndex>Huge</pIndex>", "<pLength>Huge</pLength>"):
        with pytest.raises(FeatureRefused, match="whole number of 64 bits"):
            _ = node_map(huge, register("X", 0, place)).integer("X").value


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ('<Integer Name="X"><pValue>X</pValue></Integer>', "depends on itself"),
        ('<Integer Name="X"><pValue>Y</pValue></Integer>', "needs Y, which is not there"),
        ('<Integer Name="X"><pValue>Device</pValue></Integer>', "needs Device"),
        ('<Integer Name="X"/>', "gives X no value"),
        ('<Integer Name="X"><Value>many</Value></Integer>', "where a number is needed"),
        (register("X", 0, Length=9), "9 bytes"),
        (register("X", 0, Length=0), "0 bytes"),
        (register("X", 0, Length=None), "0 bytes"),
        (register("X", 0, tag="MaskedIntReg"), "no LSB"),
        (register("X", 0, tag="MaskedIntReg", Bit=32), "bits 32 to 32"),
        ('<IntSwissKnife Name="X"/>', "no Formula"),
        ('<IntConverter Name="X"/>', "no pValue"),
    ],
)
def test_a_broken_node_is_named(nodes: str, words: str) -> None:
    with pytest.raises(FeatureFileInvalid, match=words):
        _ = node_map(nodes).integer("X").value


def test_a_file_that_goes_round_in_wide_circles_is_refused() -> None:
    knife = (
        '<IntSwissKnife Name="K{0}"><pVariable Name="A">K{1}</pVariable><Formula>A + A</Formula>'
        "</IntSwissKnife>"
    )
    circle = [knife.format(i, (i + 1) % 30) for i in range(30)]
    with pytest.raises(FeatureFileInvalid, match="depends on itself"):
        _ = node_map(*circle).integer("K0").value
    tower = [knife.format(i, i + 1) for i in range(40)] + [constant("K40", 1)]
    assert node_map(*tower).integer("K0").value == 2**40
    deep = [f'<Integer Name="K{i}"><pValue>K{i + 1}</pValue></Integer>' for i in range(3000)]
    with pytest.raises(FeatureFileInvalid, match="too many others"):
        _ = node_map(*deep, constant("K3000", 1)).integer("K0").value


def test_a_feature_of_another_kind_is_missing() -> None:
    features = node_map(*WIDTH)
    for absent in ("Height", "Device"):
        assert absent not in features
        with pytest.raises(FeatureMissing, match=f"no feature {absent}"):
            _ = features[absent]
    with pytest.raises(FeatureMissing, match="Width is no float, but Integer"):
        features.floating("Width")
    assert set(features) == {"Width", "WidthReg", "Limit"}


def test_the_category_tree_opens_each_category_once() -> None:
    features = node_map(
        '<Category Name="Root"><pFeature>A</pFeature><pFeature>Absent</pFeature></Category>',
        '<Category Name="A"><pFeature>X</pFeature><pFeature>Root</pFeature></Category>',
        constant("X", 1),
    )
    assert [(d, f.name) for d, f in features.root.walk()] == [(0, "A"), (1, "X"), (1, "Root")]


class Unplugged(MemoryRegisters):
    def read(self, address: int, length: int) -> bytes:
        raise CameraUnplugged("No camera answers.")


def test_what_the_channel_raises_comes_through() -> None:
    features = node_map(register("X", 0), registers=Unplugged())
    for _ in range(2):
        with pytest.raises(CameraUnplugged):
            _ = features.integer("X").value


def test_a_real_camera_is_set_up_by_its_file(real: Path) -> None:
    """Registers with all bits set: everything is there, and nothing is in range."""
    data = (real / "genicam" / "PGR_BlackflyS_16S2M.xml").read_bytes()
    features = NodeMap(load_feature_file(data), MemoryRegisters(bytearray(b"\xff" * 2**20)))
    assert features.integer("SensorWidth").value == 1440
    assert features["SensorWidth"].access is Access.READ_ONLY
    selector = features.enumeration("TriggerSelector")
    assert "FrameStart" in [entry.symbol for entry in selector.entries]
    assert "TriggerMode" in selector.selected
    assert features["TriggerSoftware"].access in (Access.NOT_AVAILABLE, Access.WRITE_ONLY)
    with pytest.raises(FeatureMissing):
        features.integer("ExposureTime")
    assert features.floating("ExposureTime").unit == "us"
