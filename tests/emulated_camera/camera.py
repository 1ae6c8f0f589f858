"""The emulated camera: registers that act, exposures, blocks and events."""

from __future__ import annotations

import errno
import struct
from collections import deque

import numpy as np

from .bootstrap import Bootstrap
from .clocks import DeviceClock
from .control import ControlChannel
from .descriptors import CONTROL_IN, CONTROL_OUT, EVENT_IN, STREAM_IN, Identity, Speed
from .events import event
from .faults import Fault, Faults
from .features import EVENTS, LINES, SHUTTER_LINE, STROBE_LINE, SYNC_LINE, table
from .framing import Frame, transfers
from .genapi_xml import description
from .head import Head
from .image_chunks import Facts, with_chunks
from .pictures import Image
from .pipes import InPipe
from .protocol import EXPOSURE_END_EVENT, SHUTTER_EVENT, TEST_EVENT, Abrm, Sirm
from .registers import AddressSpace
from .sensor import Eyes, Imager, Sensor
from .settings import Settings
from .shutter import READOUT_NS, Exposure, Shutter

BROWN_OUT_NS = 3_000_000
RESET_NS = 300_000_000
"""How long a camera is away when it is told to reset."""


NO_PIXELS = np.zeros((0, 0), np.uint8)
SOURCES = {Eyes.ALTERNATING: ("Source0", "Source1")}


class Camera:
    """A USB function (see `usb_device.UsbFunction`); used under the bus's lock."""

    def __init__(self, identity: Identity, sensor: Sensor, head: Head) -> None:
        self.identity = identity
        self.sensor = sensor
        self.faults = Faults()
        self.pipes = {endpoint: InPipe(1024) for endpoint in (CONTROL_IN, EVENT_IN, STREAM_IN)}
        self._head = head
        head.wire(self)
        space = AddressSpace()
        sources = SOURCES.get(sensor.eyes, ("Source0",))
        self._blocks_per_exposure = len(sources)
        self.settings = Settings(table(sensor.size_px, sources), space)
        self.xml = description(identity.model, self.settings.features, self.settings.slots)
        self.bootstrap = Bootstrap(identity, self.xml, sensor.file_kind, space)
        self.shutter = Shutter(self.settings)
        self._control = ControlChannel(space, self.faults)
        self._user_sets = dict.fromkeys((0, 1), self.settings.snapshot())
        self._imager = Imager(sensor, self.settings)
        self._exposing: deque[tuple[Exposure, float, tuple[Image, Image]]] = deque()
        self._pressed = 0
        self._connect()

    def powered(self, speed: Speed, now_ns: int) -> None:
        self.settings.restore(self._user_sets[0])
        self.bootstrap.powered(speed)
        self.shutter.stop()
        self._clock = DeviceClock(now_ns, self.sensor.drift_ppm)
        self._speed = speed
        self._bytes_per_s = self.sensor.bytes_per_s or speed.bytes_per_s
        self._block_id = 0
        self._exposing.clear()
        for endpoint in self.pipes:
            self.pipes[endpoint] = InPipe(speed.packet_bytes)
        self._sized()

    def received(self, endpoint: int, data: bytes, now_ns: int) -> None:
        if endpoint != CONTROL_OUT:
            return
        for reply in self._control.answer(data):
            after_ns = round((reply.after_ms + self.sensor.ack_ms) * 1e6)
            self.pipes[CONTROL_IN].send(reply.data, now_ns + after_ns)

    def poll(self, now_ns: int) -> None:
        for exposure in self.shutter.free_running(now_ns):
            self._expose(exposure)
        while self._exposing and self._exposing[0][0].end_ns <= now_ns:
            self._read_out(*self._exposing.popleft())

    def press_shutter(self) -> None:
        """The head's own button, from any thread."""
        with self._head.bus.changed:
            now_ns = self._head.now_ns()
            self._pressed += 1
            if self.settings.integer("EventNotification", EVENTS["Line0RisingEdge"]):
                self._event(SHUTTER_EVENT, now_ns, self._pressed)
            self.edge(SHUTTER_LINE, True, now_ns)
            self.edge(SHUTTER_LINE, False, now_ns)
            self._head.bus.changed.notify_all()

    def edge(self, line: str, rising: bool, now_ns: int) -> None:
        index = LINES[line]
        if self.settings.chosen("LineMode", index) != "Input":
            return
        inverted = bool(self.settings.integer("LineInverter", index))
        if self.shutter.triggers(line, rising != inverted):
            self._trigger(now_ns)

    def _connect(self) -> None:
        on_write, sirm = self.settings.on_write, self.bootstrap.sirm
        on_write("AcquisitionStart", self._start)
        on_write("AcquisitionStop", self._stop)
        on_write("TriggerSoftware", self._software_trigger)
        on_write("TimestampLatch", self._latch_feature)
        on_write("UserSetLoad", self._load)
        on_write("UserSetSave", self._save)
        on_write("DeviceReset", self._reset)
        for name in ("Width", "Height", "ChunkModeActive", "ChunkEnable"):
            on_write(name, self._sized)
        sirm(Sirm.CONTROL).written = self._stream_switched
        self.bootstrap.abrm(Abrm.TIMESTAMP_LATCH).written = self._latch
        self.bootstrap.test_event.written = self._send_test_event
        self.settings.register("LineStatusAll").refresh = self._show_lines

    def _start(self) -> None:
        self.settings.register("AcquisitionStart").integer = 0
        if not self.shutter.running:
            self._block_id = 0
            self.shutter.start(self._head.now_ns())

    def _stop(self) -> None:
        self.settings.register("AcquisitionStop").integer = 0
        self.shutter.stop()

    def _software_trigger(self) -> None:
        if self.shutter.triggers("Software"):
            self._trigger(self._head.now_ns())

    def _trigger(self, now_ns: int) -> None:
        if self.faults.strikes(Fault.SILENT):
            return
        exposure = self.shutter.fire(now_ns)
        if exposure is None:
            return
        self._expose(exposure)
        if self.faults.strikes(Fault.BROWN_OUT):
            self._head.later(BROWN_OUT_NS, lambda: self._head.bus.unplug(self))

    def _expose(self, exposure: Exposure) -> None:
        """The flash and the wire first: the other eye's exposure begins with this one."""
        strobe = self._output(STROBE_LINE, exposure)
        if strobe and not self.faults.strikes(Fault.DARK):
            self._head.flash(*strobe)
        if self._output(SYNC_LINE, exposure):
            self._head.edge(self, SYNC_LINE, True, exposure.start_ns)
            self._head.edge(self, SYNC_LINE, False, exposure.end_ns)
        self._exposing.append((exposure, self._head.lit_us(exposure), self._head.look(exposure)))

    def _output(self, line: str, exposure: Exposure) -> tuple[int, int] | None:
        """From when to when this exposure raises a line; None where it does not."""
        index = LINES[line]
        if self.settings.chosen("LineMode", index) != "Output":
            return None
        if self.settings.integer("LineInverter", index):
            return None
        match self.settings.chosen("LineSource", index):
            case "ExposureActive":
                return exposure.start_ns, exposure.end_ns
            case "Timer0Active" if self.settings.chosen("TimerTriggerSource") == "ExposureStart":
                start_ns = exposure.start_ns + round(self.settings.real("TimerDelay") * 1000)
                return start_ns, start_ns + round(self.settings.real("TimerDuration") * 1000)
        return None

    def _read_out(self, exposure: Exposure, lit_us: float, pictures: tuple[Image, Image]) -> None:
        if self.settings.integer("EventNotification", EVENTS["ExposureEnd"]):
            self._event(EXPOSURE_END_EVENT, exposure.end_ns, self._block_id)
        if not self._has_room():
            self._block_id += self._blocks_per_exposure
            return
        swapped = self.faults.strikes(Fault.SWAPPED_EYES)
        left, right = pictures[::-1] if swapped else pictures
        for source, image in enumerate(self._imager.images(left, right, exposure, lit_us)):
            facts = Facts(
                block_id=self._block_id,
                timestamp_ns=self._clock.at(exposure.start_ns),
                exposure_us=exposure.length_us,
                gain_db=self.settings.real("Gain"),
                lines=int(bool(self._output(STROBE_LINE, exposure))) << LINES[STROBE_LINE],
                source=source if self._blocks_per_exposure > 1 else None,
            )
            self._block_id += 1
            self._send_block(image, facts, exposure.end_ns)

    def _has_room(self) -> bool:
        """Whether anybody wants blocks, and fetches them."""
        pipe = self.pipes[STREAM_IN]
        most = self.sensor.blocks_kept * self.settings.integer("PayloadSize")
        return self.bootstrap.streaming and not pipe.halted and pipe.waiting_bytes() < most

    def _send_block(self, image: Image, facts: Facts, end_ns: int) -> None:
        if self.faults.strikes(Fault.BLOCK_GAP):
            return
        pipe = self.pipes[STREAM_IN]
        x, y, width, height = self._imager.region()
        frame = Frame(
            block_id=facts.block_id,
            timestamp_ns=facts.timestamp_ns,
            pixel_format=self.settings.integer("PixelFormat"),
            width=width,
            height=height,
            offset_x=x,
            offset_y=y,
            data=with_chunks(image, facts, self.settings),
            has_chunks=bool(self.settings.integer("ChunkModeActive")),
        )
        ready_ns = max(end_ns + READOUT_NS, pipe.last_ready_ns())
        for outgoing in transfers(frame, self.bootstrap.sizes, self.faults):
            if outgoing.error == errno.EPROTO:
                self.settings.register("LinkErrorCount").integer += 1
            ready_ns += round(len(outgoing.data) / self._link_bytes_per_s() * 1e9)
            outgoing.ready_ns = ready_ns
            pipe.put(outgoing)

    def _link_bytes_per_s(self) -> float:
        if self.settings.chosen("DeviceLinkThroughputLimitMode") == "On":
            limit = self.settings.integer("DeviceLinkThroughputLimit")
            return min(self._bytes_per_s, limit)
        return self._bytes_per_s

    def _event(self, number: int, now_ns: int, value: int) -> None:
        if self.bootstrap.sends_events:
            data = struct.pack("<Q", value)
            self.pipes[EVENT_IN].send(event(number, self._clock.at(now_ns), data), now_ns)

    def _send_test_event(self) -> None:
        self.bootstrap.test_event.integer = 0
        self._event(TEST_EVENT, self._head.now_ns(), 0)

    def _stream_switched(self) -> None:
        self.pipes[STREAM_IN].clear()

    def _sized(self) -> None:
        _, _, width, height = self._imager.region()
        facts = Facts(source=0 if self._blocks_per_exposure > 1 else None)
        size = width * height + len(with_chunks(NO_PIXELS, facts, self.settings))
        self.settings.register("PayloadSize").integer = size
        self.bootstrap.sirm(Sirm.REQUIRED_PAYLOAD).integer = size

    def _latch(self) -> None:
        now = self._clock.at(self._head.now_ns())
        self.bootstrap.abrm(Abrm.TIMESTAMP).integer = now
        self.settings.register("TimestampLatchValue").integer = now

    def _latch_feature(self) -> None:
        self._latch()
        self.settings.register("TimestampLatch").integer = 0

    def _load(self) -> None:
        self.settings.restore(self._user_sets[self.settings.integer("UserSetSelector")])
        self._sized()

    def _save(self) -> None:
        if chosen := self.settings.integer("UserSetSelector"):
            self._user_sets[chosen] = self.settings.snapshot()

    def _reset(self) -> None:
        self._head.bus.unplug(self)
        self._head.later(RESET_NS, self._plug_again)

    def _plug_again(self) -> None:
        self._head.bus.plug(self, self._speed)

    def _show_lines(self) -> None:
        level = self.settings.integer("UserOutputValue")
        outputs = 0
        for line, index in LINES.items():
            if self.settings.chosen("LineSource", index) == "UserOutput0":
                outputs |= level << LINES[line]
        self.settings.register("LineStatusAll").integer = outputs
