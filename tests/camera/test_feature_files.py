"""Feature files are read, plain or zipped, or refused in one sentence."""

from __future__ import annotations

import io
import json
import time
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from register_files import HEAD, MemoryRegisters, feature_file, node_map, register

from fieldcam.camera.genapi import (
    NoCamera,
    NodeMap,
    declared_entries,
    load_feature_file,
    present_entries,
)
from fieldcam.cli import main
from fieldcam.errors import ExitCode, FeatureFileInvalid, FieldcamError
from fieldcam.foreign.bounds import FEATURES

FOREIGN = Path(__file__).parents[1] / "foreign_samples"
CAMERA_XML = FOREIGN / "camera_xml"
SMALL = feature_file(
    '<Category Name="Root"><pFeature>Device</pFeature><pFeature>Width</pFeature></Category>',
    '<Group Comment="size"><Integer Name="Width"><pValue>WidthReg</pValue><Min>16</Min>',
    "<pMax>WidthMax</pMax><Inc>4</Inc><Unit>px</Unit></Integer></Group>",
    register("WidthReg", 16),
    '<IntSwissKnife Name="WidthMax"><pVariable Name="W">WidthReg</pVariable>',
    "<Formula>W &lt; 2 &amp;&amp; W = 0 ? 64 : W * 2</Formula></IntSwissKnife>",
    '<Float Name="Gain"><Value>1.5</Value></Float>',
)


def zipped(content: bytes = SMALL, *names: str, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name in names or ("camera.xml",):
            archive.writestr(zipfile.ZipInfo(name), content, method)
    return buffer.getvalue()


def of_several(*files: tuple[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files:
            archive.writestr(name, content)
    return buffer.getvalue()


def streamed(method: int) -> bytes:
    """As written to a pipe: lengths stand behind the data."""

    class Pipe(io.BytesIO):
        def seekable(self) -> bool:
            return False

    pipe = Pipe()
    with zipfile.ZipFile(pipe, "w", method) as archive:
        archive.writestr("camera.xml", SMALL)
    return pipe.getvalue()


def with_extra(extra: bytes) -> bytes:
    """In front of the data, of a length that its own header denies."""
    plain = zipped()
    name = 30 + len("camera.xml")
    return plain[:28] + len(extra).to_bytes(2, "little") + plain[30:name] + extra + plain[name:]


def described_as(text: bytes) -> bytes:
    return SMALL.replace(
        b'<Float Name="Gain">', b'<Float Name="Gain"><ToolTip>' + text + b"</ToolTip>"
    )


def width() -> bytes:
    """A node that is declared again, as it was."""
    return SMALL[SMALL.index(b'<Integer Name="Width">') : SMALL.index(b"</Group>")]


EMPTY_ZIP = b"PK\5\6" + bytes(18)


@pytest.mark.parametrize(
    "data",
    [
        SMALL,
        b"\n " + SMALL + b"\r\n" + bytes(100),
        b"\xef\xbb\xbf" + SMALL,
        SMALL.decode().encode("utf-16"),
        b"Maker-Camera 12 (USB3)\n" + SMALL,
        b'<!-- Maker-Camera 12 (USB3) -->\r\n<?xml version="1.0"?>\r\n' + SMALL,
        SMALL.replace(b"http://www.genicam.org/GenApi/Version_1_1", b"urn:another"),
        zipped(),
        zipped(SMALL, "camera.xml", "another.xml"),
        zipped(SMALL, ""),
        of_several(("a.xml", b"<other/>"), ("camera.xml", SMALL)),
        b"<!DOCTYPE RegisterDescription []>" + SMALL,
        zipped(SMALL, "camera.txt", "folder.xml/"),
        bytes(12) + zipped(),
        zipped()[:-30],
        streamed(zipfile.ZIP_DEFLATED),
        streamed(zipfile.ZIP_STORED),
        with_extra(b"\x01\x02\x03"),
        with_extra(b"\x0a\x00\xff\xff\x01"),
        SMALL + b"   old text of a longer file</x>",
        SMALL + b"<RegisterDescription/>",
        SMALL.replace(b"xmlns=", b"xmlns:schemaLocation='http://www.genicam.org' xmlns="),
        SMALL.replace(b"<Float ", b"<Float xsi:type='a' ")
        .replace(b"<Group ", b"<gen:Group ")
        .replace(b"</Group>", b"</gen:Group>"),
        b'<?xml version="1.0"?><!DOCTYPE RegisterDescription>\n' + SMALL,
        b"<!DOCTYPE RegisterDescription SYSTEM 'http://nowhere/GenApi.dtd'>\n" + SMALL,
        described_as(b"Xyz\xae sensor"),
        described_as("Größe in µm".encode() + b" or \xb5m"),
        described_as(b"R&D of &nbsp;&micro;m &unknown;"),
        described_as(b"\x0b\x00\x1f"),
        b'<?xml version="1.0" encoding="klingon"?>' + SMALL,
        b'<?xml version="1.0" encoding="UTF-16"?>' + SMALL,
        b'<?xml version="1.0" encoding="utf-7"?>' + SMALL,
        b'<?xml version="1.0" encoding="us-ascii"?>' + described_as(b"\xb5m"),
        b'<?xml version="1.0" encoding="windows-1252"?>' + described_as(b"\x80"),
        b'<?xml version="1.0" encoding="GB2312"?>' + described_as("宽度".encode("gb2312")),
        b'<?xml version="1.0" encoding="Shift_JIS"?>' + described_as("幅".encode("shift_jis")),
        SMALL.decode().encode("utf-16-le"),
        b'<?xml version="1.0"?>'.decode().encode("utf-16-be") + SMALL.decode().encode("utf-16-be"),
        SMALL.replace(b"</Group>", b"</Group><Float Name='Width'/>" + width()),
        zipped(SMALL, "read_me.txt", "camera.XML"),
        zipped(SMALL, "camera.xml", "__MACOSX/._camera.xml"),
        zipped(method=zipfile.ZIP_STORED),
        zipped() + bytes(64),
    ],
)
def test_a_feature_file_is_read(data: bytes) -> None:
    document = load_feature_file(data)
    assert (document.vendor, document.model, document.schema_version) == ("Test", "Made", "1.1")
    assert NodeMap(document, MemoryRegisters()).integer("Width").max == 64


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no proper XML"),
        (b"<a>", "no proper XML"),
        (b"<a/>", "RegisterDescription"),
        (SMALL[:-20], "no proper XML"),
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]>" + SMALL, "document type"),
        (b"<!DOCTYPE a [<!ENTITY % b 'c'>%b;]>" + SMALL, "document type"),
        (b"<!DOCTYPE a SYSTEM 'file:///etc/passwd' [<!ATTLIST a b CDATA 'c'>]>" + SMALL, "type"),
        (HEAD.encode() + b"<Group>" * 50, "nests too deep"),
        (SMALL + b" " * FEATURES.most_bytes, "16 MiB"),
        (zipped(b"read me", "read_me.txt"), "no proper XML"),
        (zipped(b"", "folder.xml/"), "holds no file"),
        (EMPTY_ZIP, "holds no file"),
        (zipped(SMALL + b" " * FEATURES.most_bytes), "16 MiB"),
        (zipped(method=zipfile.ZIP_BZIP2), "unusual"),
        (zipped()[:60], "damaged"),
    ],
)
def test_what_is_no_feature_file_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(FeatureFileInvalid, match=words):
        load_feature_file(data)


def test_a_zip_that_lies_about_its_size_is_refused() -> None:
    """The bomb's size is given as 1 byte in both of its headers."""
    bomb = zipped(SMALL + b" " * (64 * 2**20))
    size = (len(SMALL) + 64 * 2**20).to_bytes(4, "little")
    with pytest.raises(FeatureFileInvalid):
        load_feature_file(bomb.replace(size, (1).to_bytes(4, "little")))


@pytest.mark.parametrize("path", sorted(CAMERA_XML.iterdir()), ids=lambda path: path.name)
def test_files_as_cameras_carry_them_are_listed(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["camera", "features", "--xml", str(path), "--json"]) == ExitCode.OK
    assert json.loads(capsys.readouterr().out)["features"]


def ask_everything(data: bytes, registers: MemoryRegisters | NoCamera) -> None:
    """Whatever the file, each question has an answer or one sentence."""
    try:
        features = NodeMap(load_feature_file(data), registers)
        nodes = [features[name] for name in features]
    except FieldcamError as error:
        assert error.message.endswith(".") and "\n" not in error.message
        return
    with suppress(FieldcamError):
        listing = declared_entries if isinstance(registers, NoCamera) else present_entries
        json.dumps(list(listing(features)), allow_nan=False)
    for node in nodes:
        for question in ("access", "value", "min", "max", "increment", "done", "length", "entries"):
            try:
                getattr(node, question, None)
            except FieldcamError as error:
                assert "\n" not in error.message


@given(data=st.binary(max_size=200), head=st.sampled_from([b"", b"PK\x03\x04", HEAD.encode()]))
def test_fuzz_random_bytes_are_read_or_refused(data: bytes, head: bytes) -> None:
    ask_everything(head + data, MemoryRegisters())


RICH = feature_file(
    '<Category Name="Root"><pFeature>Sel</pFeature><pFeature>Root</pFeature></Category>',
    '<Enumeration Name="Sel"><EnumEntry Name="A"><pIsImplemented>Bit</pIsImplemented><Value>0',
    '</Value></EnumEntry><EnumEntry Name="B"><Value>1</Value></EnumEntry><pValue>R</pValue>',
    "<pSelected>F</pSelected></Enumeration>",
    register("R", 4, "<pInvalidator>Sel</pInvalidator>", Length=2),
    register("Bit", 4, tag="MaskedIntReg", Bit=3, Endianess="BigEndian"),
    register("Text", 40, tag="StringReg", Length=8),
    register("Real", 48, tag="FloatReg"),
    '<Converter Name="F"><pVariable Name="X">R</pVariable><FormulaTo>FROM*X</FormulaTo>',
    "<FormulaFrom>TO/X+1</FormulaFrom><pValue>Real</pValue></Converter>",
    '<IntSwissKnife Name="K"><pVariable Name="S">Sel</pVariable><Constant Name="C">3</Constant>',
    '<Expression Name="D">C*2</Expression><Formula>S=0?D:C</Formula></IntSwissKnife>',
    register("At", 8, '<pIndex Offset="4">K</pIndex>', "<pAddress>R</pAddress>"),
    '<Integer Name="I"><pIndex>K</pIndex><ValueIndexed Index="3">7</ValueIndexed>',
    "<ValueDefault>1</ValueDefault><pMin>R</pMin><pIsLocked>Bit</pIsLocked></Integer>",
    '<Boolean Name="On"><pValue>Bit</pValue></Boolean>',
    '<Command Name="Go"><pValue>R</pValue><CommandValue>1</CommandValue></Command>',
    '<StructReg Name="S"><Address>60</Address><Length>4</Length><pPort>Device</pPort>',
    "<Endianess>LittleEndian</Endianess>",
    '<StructEntry Name="S1"><LSB>0</LSB><MSB>3</MSB></StructEntry></StructReg>',
    '<Port Name="ChunkPort"><ChunkID>a1</ChunkID></Port>',
    register("InChunk", 0, pPort="ChunkPort"),
)
WORDS = [
    *[b"", b"R", b"K", b"Sel", b"F", b"I", b"At", b"Bit", b"Text", b"Root", b"-1", b"99999999999"],
    *[b"pValue", b"pAddress", b"Integer", b"Float", b"<", b"/>", b"(", b"**", b"1e999", b"\0"],
]


@given(data=st.data())
def test_fuzz_changed_files_are_answered_or_refused(data: st.DataObject) -> None:
    content = bytearray(RICH)
    for _ in range(data.draw(st.integers(1, 5))):
        place = data.draw(st.integers(len(HEAD), len(content) - 1))
        length = data.draw(st.sampled_from([0, 1, 1, 2, 3, 8]))
        content[place : place + length] = data.draw(st.sampled_from(WORDS))
    memory = bytearray(data.draw(st.binary(min_size=64, max_size=64)) * 4)
    ask_everything(bytes(content), MemoryRegisters(memory))


@given(data=st.data())
def test_fuzz_references_crossed_at_random_are_answered_or_refused(data: st.DataObject) -> None:
    """Well-formed files whose references lead anywhere, in circles too."""
    names = [b"Sel", b"R", b"Bit", b"Text", b"Real", b"F", b"K", b"At", b"I", b"On", b"Go", b"S1"]
    content = RICH
    for name in names:
        target = data.draw(st.sampled_from(names))
        if data.draw(st.booleans()):
            content = content.replace(b">" + name + b"</p", b">" + target + b"</p")
    ask_everything(content, MemoryRegisters(bytearray(b"\1\2\0\0" * 64)))


def test_three_thousand_nodes_load_within_two_seconds(note: Callable[[str], None]) -> None:
    nodes = [
        f'<Integer Name="N{i}"><ToolTip>One of many.</ToolTip><pValue>R{i}</pValue>'
        f"<Min>0</Min><pMax>R{i}</pMax></Integer>" + register(f"R{i}", 4 * (i % 60))
        for i in range(1500)
    ]
    root = "".join(f"<pFeature>N{i}</pFeature>" for i in range(1500))
    data = feature_file(f'<Category Name="Root">{root}</Category>', *nodes)
    began_at = time.perf_counter()
    features = NodeMap(load_feature_file(data), MemoryRegisters())
    assert sum(1 for _ in features.root.walk()) == 1500
    took_s = time.perf_counter() - began_at
    note(f"a feature file of 3,000 nodes loads in {took_s:.2f} s.")
    assert took_s < 2


def chained(*links: str) -> bytes:
    """Sixty nodes, each made of the one before it by these elements, `{}` standing for it."""
    names = "".join(f"<pFeature>k{i}</pFeature>" for i in range(60))
    kind = "IntSwissKnife" if "<Formula>" in links[-1] else "Integer"
    return feature_file(
        f'<Category Name="Root">{names}</Category><Integer Name="k0"><Value>1</Value></Integer>',
        *[
            f'<{kind} Name="k{i}">{"".join(links).format(f"k{i - 1}")}</{kind}>'
            for i in range(1, 60)
        ],
    )


TWICE = '<pVariable Name="A">{0}</pVariable><pVariable Name="B">{0}</pVariable>'
COSTLY = {
    "a cascade": (FOREIGN / "hostile" / "cascade.xml").read_bytes(),
    "one variable twice": chained('<pVariable Name="A">{0}</pVariable>', "<Formula>A+A</Formula>"),
    "two variables": chained(TWICE, "<Formula>A+B</Formula>"),
    "bounds": chained("<pValue>{0}</pValue><pMin>{0}</pMin><pMax>{0}</pMax><pInc>{0}</pInc>"),
    "conditions": chained(
        "<pValue>{0}</pValue><pIsLocked>{0}</pIsLocked><pIsAvailable>{0}</pIsAvailable>"
    ),
    "repeated text": feature_file(
        '<Category Name="Root"><pFeature>W</pFeature></Category><Integer Name="W"><ToolTip>',
        "a&amp;\n" * 1_000_000,
        "</ToolTip><Value>1</Value></Integer>",
    ),
    "a large structure": feature_file(
        '<StructReg Name="S">',
        "<Address>1</Address>" * 20_000,
        '<StructEntry Name="a"/>' * 20_000,
        "</StructReg>",
    ),
    "formulas": feature_file(
        *[
            f'<IntSwissKnife Name="k{i}"><Formula>{"+".join("1" * 9_000)}</Formula></IntSwissKnife>'
            for i in range(300)
        ]
    ),
    "elements": feature_file('<Integer Name="a"/>' * 101_000),
}


@pytest.mark.parametrize("name", COSTLY)
def test_what_costs_more_than_a_cameras_file_is_bounded(name: str) -> None:
    began_s = time.process_time()
    for registers in (NoCamera(), MemoryRegisters()):
        with suppress(FieldcamError):
            features = NodeMap(load_feature_file(COSTLY[name]), registers)
            listing = declared_entries if isinstance(registers, NoCamera) else present_entries
            list(listing(features))
    assert time.process_time() - began_s < 5


def test_a_write_reaches_a_long_chain_at_once() -> None:
    nodes = [
        f'<Integer Name="n{i}"><pValue>n{i + 1}</pValue><pInvalidator>n{i // 2}</pInvalidator>'
        "</Integer>"
        for i in range(10_000)
    ]
    features = node_map(*nodes)
    began_s = time.process_time()
    features.changed("n0")
    assert time.process_time() - began_s < 1.5


def test_a_list_that_takes_too_long_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fieldcam.camera.genapi.listing.MAX_LISTING_CPU_S", 0.0)
    (width,) = declared_entries(NodeMap(load_feature_file(SMALL), NoCamera()))
    assert width["problem"] == "It was not asked: the features before it took too long."


def test_what_one_feature_gets_wrong_does_not_hide_the_others() -> None:
    """The choice's register holds no entry; the step's holds NaN."""
    features = node_map(
        '<Category Name="Root"><pFeature>Hidden</pFeature><pFeature>Real</pFeature></Category>',
        '<Enumeration Name="Choice"><EnumEntry Name="A"><Value>0</Value></EnumEntry>',
        "<pValue>R</pValue></Enumeration>",
        register("R", 0),
        '<Integer Name="Hidden"><pIsAvailable>Choice</pIsAvailable><Value>1</Value></Integer>',
        '<Float Name="Real"><Value>2</Value><pInc>Step</pInc></Float>',
        register("Step", 8, tag="FloatReg", Length=8),
        registers=MemoryRegisters(bytearray(b"\xff" * 64)),
    )
    hidden, real = present_entries(features)
    assert "none of its entries" in hidden["problem"]
    assert (real["value"], real["increment"]) == (2.0, None)


def test_what_a_category_names_and_the_file_lacks_is_listed_in_its_place(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "cut.xml"
    path.write_bytes(
        feature_file(
            '<Category Name="Root"><pFeature>Gone</pFeature><pFeature>A</pFeature></Category>',
            '<Category Name="A"><pFeature>X</pFeature><pFeature>Lost</pFeature>'
            "<pFeature>Device</pFeature><pFeature>A</pFeature></Category>",
            '<Integer Name="X"><Value>1</Value></Integer>',
        )
    )
    assert main(["camera", "features", "--xml", str(path), "--json"]) == ExitCode.OK
    found = json.loads(capsys.readouterr().out)["features"]
    assert [(entry["name"], entry["depth"], entry["type"]) for entry in found] == [
        ("Gone", 0, "missing"),
        ("A", 0, "category"),
        ("Lost", 1, "missing"),
        ("X", 1, "integer"),
        ("A", 1, "category"),
    ]
    assert main(["camera", "features", "--xml", str(path)]) == ExitCode.OK
    assert "A names it, and the file does not declare it." in capsys.readouterr().out


def test_a_real_cameras_file_is_listed(
    real: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    plain = real / "genicam" / "PGR_BlackflyS_16S2M.xml"
    packed = tmp_path / "camera.zip"
    packed.write_bytes(zipped(plain.read_bytes()))
    documents = []
    for path in (plain, packed):
        assert main(["camera", "features", "--xml", str(path), "--json"]) == ExitCode.OK
        documents.append(json.loads(capsys.readouterr().out))
    assert documents[0] == documents[1]
    entries = {entry["name"]: entry for entry in documents[0]["features"]}
    assert documents[0]["model"] == "BFS_U3_16S2"
    assert len(entries) > 300
    assert not [entry for entry in entries.values() if "problem" in entry]
    assert entries["SensorWidth"]["value"] == 1440
    exposure = entries["ExposureTime"]
    assert (exposure["type"], exposure["unit"], exposure["min"]) == ("float", "us", None)
    assert [e["name"] for e in entries["TriggerMode"]["entries"]] == ["Off", "On"]
    assert entries["TriggerSoftware"]["access"] == "WO"


def test_the_listing_says_what_needs_the_camera(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "camera.xml"
    path.write_bytes(SMALL.replace(b"<pFeature>Device<", b"<pFeature>Gain<"))
    assert main(["camera", "features", "--xml", str(path)]) == ExitCode.OK
    printed = capsys.readouterr()
    gain, width = printed.out.splitlines()[1:]
    assert gain.split() == ["Gain", "float", "RW", "=", "1.5"]
    assert "16 to (ask the camera) in steps of 4 px" in width
    assert "Test Made" in printed.err


@pytest.mark.parametrize(
    ("content", "words"), [(None, "There is no feature file"), (b"x", "no proper XML")]
)
def test_a_bad_file_ends_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes | None, words: str
) -> None:
    path = tmp_path / "camera.xml"
    if content is not None:
        path.write_bytes(content)
    assert main(["camera", "features", "--xml", str(path)]) == ExitCode.BAD_INPUT
    assert words in capsys.readouterr().err
