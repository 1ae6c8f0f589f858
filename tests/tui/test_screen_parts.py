"""What the screens are made of: colours, letters, the small picture, sounds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from live_walks import read
from made_states import AIM, shown_with
from textual.color import Color
from textual.theme import Theme

from fieldcam.disk.raw_images import encode_raw
from fieldcam.tui import themes
from fieldcam.tui.sound import Bell, Player, Silence, Tune, chosen_sound, waves
from fieldcam.tui.text.letters import HEIGHT, big, shape
from fieldcam.tui.text.telling import banner, lights, sizes_heading
from fieldcam.tui.widgets.cell_picture import full_cells, half_blocks
from fieldcam.tui.widgets.picture import OUTLINE, STRUCK, Cutout, colours, frame_of, shrink, still
from fieldcam.values import PixelFormat, Reason, ReasonCode, Status, Verdict

MIN_CONTRAST = 7.0


@pytest.mark.parametrize("theme", themes.ALL, ids=lambda theme: theme.name)
@pytest.mark.parametrize("name", ["primary", "success", "warning", "error", "foreground"])
def test_status_colours_can_be_read_in_the_sun(theme: Theme, name: str) -> None:
    assert contrast(getattr(theme, name), theme.background) >= MIN_CONTRAST


@pytest.mark.parametrize("theme", themes.ALL, ids=lambda theme: theme.name)
def test_bars_can_be_read_in_the_sun(theme: Theme) -> None:
    assert contrast(theme.foreground, theme.panel) >= MIN_CONTRAST
    key, ground = (theme.variables[f"footer-{name}"] for name in ("key-foreground", "background"))
    assert contrast(key, ground) >= MIN_CONTRAST


def test_one_of_a_thing_is_not_many(tmp_path: Path) -> None:
    one = replace(AIM, before=1)
    assert banner(one).sentence.endswith("Last visit it had 1 fruitlet.")
    assert sizes_heading(replace(one, shown=shown_with(tmp_path, read(12, 1)))).startswith(
        "1 fruitlet, last visit 1"
    )
    assert sizes_heading(replace(AIM, shown=shown_with(tmp_path, read(12, 2)))).startswith(
        "2 fruitlets, last visit 5"
    )


def test_a_light_claims_nothing_that_was_not_measured(tmp_path: Path) -> None:
    """Without a tag no depth counts, and in the dark nothing tells whether it is sharp."""

    def shining(*codes: ReasonCode) -> dict[str, bool | None]:
        reasons = tuple(Reason(code, "") for code in codes)
        unread = replace(read(12), verdict=Verdict(Status.RETAKE, reasons))
        return {light.name: light.good for light in lights(shown_with(tmp_path, unread))}

    dark = shining(ReasonCode.TOO_DARK, ReasonCode.NO_TAG)
    assert dark == {"tag": False, "sharpness": None, "light": False, "depth": None}
    blurred = shining(ReasonCode.BLURRED, ReasonCode.NO_TAG)
    assert blurred == {"tag": False, "sharpness": False, "light": True, "depth": None}
    coarse = shining(ReasonCode.TOO_COARSE)
    assert coarse == {"tag": True, "sharpness": False, "light": True, "depth": True}


def test_one_key_leads_to_the_other_theme_and_back() -> None:
    for theme in themes.ALL:
        other = themes.OTHER[theme.name]
        assert other != theme.name and themes.OTHER[other] == theme.name


def contrast(colour: str | None, ground: str | None) -> float:
    """Contrast ratio of WCAG 2, 1 to 21."""
    assert colour is not None and ground is not None
    both = (luminance(Color.parse(colour)), luminance(Color.parse(ground)))
    return (max(both) + 0.05) / (min(both) + 0.05)


def luminance(colour: Color) -> float:
    """Relative luminance of WCAG 2."""
    shares = np.array(colour.rgb) / 255
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


WORDS = ["ACCEPT", "CONFIRM", "RETAKE", "SAVED", "TAKING", "AIM", "DONE", "AGAIN", "CAMERA"]


@pytest.mark.parametrize("word", [*WORDS, "NOT SAVED", "NO SIZES", "ALL DONE", "0123456789/"])
def test_letters_are_full_blocks_of_one_width(word: str) -> None:
    lines = big(word)
    assert len(lines) == HEIGHT and len({len(line) for line in lines}) == 1
    assert set("".join(lines)) <= {"█", " "}
    assert [len(line) for line in big(word, 2)] == [2 * len(line) for line in lines]


@pytest.mark.parametrize("name", ["tick", "query", "cross", "dots", "none"])
def test_shapes_are_as_high_as_letters(name: str) -> None:
    lines = shape(name)
    assert len(lines) == HEIGHT and len({len(line) for line in lines}) == 1


def test_a_small_picture_is_made_of_block_means() -> None:
    image = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
    small = shrink(image, Cutout(0, 0, 2), (3, 2))
    np.testing.assert_array_equal(
        small, image.reshape(2, 2, 3, 2, 3).mean(axis=(1, 3)).astype(np.uint8)
    )


def test_outside_the_picture_it_is_black() -> None:
    small = shrink(np.full((4, 4, 3), 9, np.uint8), Cutout(-2, -2, 2), (4, 4))
    expected = np.zeros((4, 4), bool)
    expected[1:3, 1:3] = True
    np.testing.assert_array_equal(small.any(axis=2), expected)


def test_a_picture_of_fewer_pixels_than_cells_repeats_them() -> None:
    small = shrink(np.full((6, 8, 3), 9, np.uint8), Cutout(0, 0, 0.2), (40, 30))
    assert small.shape == (30, 40, 3) and (small == 9).all()


@pytest.mark.parametrize("pixel_format", list(PixelFormat))
def test_each_pixel_format_has_its_colours(pixel_format: PixelFormat) -> None:
    red, green, blue = (200, 100, 50)
    cells = {
        PixelFormat.BAYER_RG8: [[red, green], [green, blue]],
        PixelFormat.BAYER_GR8: [[green, red], [blue, green]],
        PixelFormat.BAYER_GB8: [[green, blue], [red, green]],
        PixelFormat.BAYER_BG8: [[blue, green], [green, red]],
    }
    if pixel_format is PixelFormat.RGB8:
        image = np.full((4, 4, 3), (red, green, blue), np.uint8)
    elif pixel_format is PixelFormat.MONO8:
        image, red, blue = np.full((4, 4), green, np.uint8), green, green
    else:
        image = np.tile(np.array(cells[pixel_format], np.uint8), (2, 2))
    assert (colours(image, pixel_format) == (red, green, blue)).all()


def test_the_picture_shows_the_target_and_its_outlines(tmp_path: Path) -> None:
    reading = read(12)
    shown = replace(shown_with(tmp_path, reading, struck=(1,)), pixel_format=PixelFormat.MONO8)
    shown.left.write_bytes(encode_raw(np.full((480, 640), 40, np.uint8)))
    small = still(shown, (40, 30))
    frame = frame_of(reading, (640, 480), (40, 30))
    for fruitlet in reading.target:
        x, y = fruitlet.center_px
        row, column = (y - frame.y0) / frame.px_per_cell, (x + 9 - frame.x0) / frame.px_per_cell
        colour = STRUCK if fruitlet.id == 1 else OUTLINE
        assert tuple(small[int(row), int(column)]) == colour
    assert (small == 40).any()


def test_without_a_reading_the_whole_picture_is_shown() -> None:
    assert frame_of(None, (640, 480), (40, 30)) == Cutout(0, 0, 16)


def test_cells_of_a_picture() -> None:
    small = np.zeros((4, 5, 3), np.uint8)
    assert [strip.text for strip in half_blocks(small)] == ["▀▀▀▀▀"] * 2
    assert [strip.text for strip in full_cells(small)] == ["     "] * 4


def test_good_and_bad_do_not_sound_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    rung: list[None] = []
    bell = Bell(lambda: rung.append(None))
    bell.play(Tune.GOOD)
    assert len(rung) == 1
    bell.play(Tune.BAD)
    assert len(rung) == 3
    assert len(waves(Tune.GOOD)) == len(waves(Tune.BAD)) < 1 << 16
    assert waves(Tune.GOOD) != waves(Tune.BAD)


def test_a_player_that_is_missing_stops_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Player, "COMMAND", ("/nonexistent/player",))
    Player().play(Tune.GOOD)


def test_the_sound_is_chosen_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    chosen = {name: type(chosen_sound(name, lambda: None)) for name in ("", "bell", "none")}
    assert chosen == {"": Bell, "bell": Bell, "none": Silence}
    monkeypatch.setattr("shutil.which", lambda name: "/usr/bin/aplay")
    assert type(chosen_sound("", lambda: None)) is Player
