import lz4.frame
import pytest
import zstandard

from climber_uk.bags.unpacking import LEAST, RATIO, Allowance, unpack

PACKERS = {"": bytes, "zstd": zstandard.compress, "lz4": lz4.frame.compress}
DATA = bytes(range(256)) * 100


@pytest.mark.parametrize("compression", PACKERS)
def test_what_was_packed_is_unpacked_up_to_its_size(compression):
    assert unpack(PACKERS[compression](DATA), compression, len(DATA)) == DATA


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("most", [0, 1, len(DATA) - 1])
def test_more_than_was_said_is_refused(compression, most):
    with pytest.raises(ValueError, match=f"unpacks to more than {most} bytes"):
        unpack(PACKERS[compression](DATA), compression, most)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_damage_is_refused_in_words(compression):
    packed = PACKERS[compression](DATA)
    for damaged in (packed[: len(packed) // 2], b"nothing of the kind", b""):
        try:
            assert unpack(damaged, compression, len(DATA)) != DATA
        except ValueError as error:
            assert str(error).startswith("does not unpack: ")  # noqa: PT017


def test_a_compression_that_nobody_knows_is_named():
    with pytest.raises(ValueError, match="compression 'brotli' is not known"):
        unpack(b"", "brotli", 5)


def test_a_file_may_unpack_to_so_much_and_no_more():
    allowance = Allowance(1000)
    allowance.take(LEAST)
    allowance.take(RATIO * 1000)
    with pytest.raises(ValueError, match="unpacks to more than 64 MiB and 32 times its size"):
        allowance.take(1)
