"""Decompress untrusted data within bounds: a small file may expand beyond any memory."""

import lz4.frame  # type: ignore[import-untyped]
import zstandard

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"  # with which no serialised message begins
LARGEST_MESSAGE = 2**24  # [bytes] of a message that is read
LARGEST_CHUNK = 2**28  # [bytes] of messages that are unpacked together
LEAST, RATIO = 2**26, 32  # a file may unpack to 64 MiB and 32 times its size
WINDOW = 2**27  # [bytes] that unpacking zstd may keep, as the command zstd has it
PIECE = 2**20  # [bytes]


class Allowance:
    """How much a file may still unpack to."""

    def __init__(self, packed: int) -> None:
        self.left = LEAST + RATIO * packed  # [bytes]

    def take(self, size: int) -> None:
        """Use some of it; raises `ValueError` where there is not enough."""
        if size > self.left:
            raise ValueError(f"unpacks to more than {LEAST >> 20} MiB and {RATIO} times its size")
        self.left -= size


def unpack(data: bytes, compression: str, most: int) -> bytes:
    """Unpack '', 'zstd' or 'lz4'; raises `ValueError` of more than `most` bytes, or of damage."""
    try:
        match compression:
            case "":
                return data
            case "zstd":
                known = zstandard.frame_content_size(data)  # negative if it is not
                size = known if 0 <= known <= most else most + 1
                unpacked = zstandard_reader(data).read(size)
            case "lz4":
                unpacked = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most + 1)
            case _:
                raise ValueError(f"compression {compression[:20]!r} is not known")
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise ValueError(f"does not unpack: {error}") from None
    if len(unpacked) > most:
        raise ValueError(f"unpacks to more than {most} bytes")
    return unpacked


def zstandard_reader(packed: object) -> zstandard.ZstdDecompressionReader:
    """Stream of the unpacked bytes of packed ones, or of a file."""
    unpacker = zstandard.ZstdDecompressor(max_window_size=WINDOW)
    return unpacker.stream_reader(packed, read_across_frames=True)  # type: ignore[arg-type]
