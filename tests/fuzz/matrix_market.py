"""What a Matrix Market text, and one of triplets, says: written from the format's definition, not from our reader."""
import re
import struct

BLANKS = rb"[ \t\r\v\f]+"
INTEGER = re.compile(rb"[+-]?[0-9]{1,18}")
REAL = re.compile(rb"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[eEdD]([+-]?[0-9]+)|([+-][0-9]+))?")
SPECIAL = re.compile(rb"[+-]?nan|[+-]?inf(inity)?", re.IGNORECASE)
MOST = 2**31 - 2


class Refused(Exception):
    pass


def lines_of(text, comment=b"%"):
    """Words of each line that is neither blank nor a comment."""
    for line in text.split(b"\n"):
        words = [word for word in re.split(BLANKS, line) if word]
        if words and not (comment and words[0].startswith(comment)):
            yield words


def integer(word):
    if not INTEGER.fullmatch(word):
        raise Refused(f"{word} is no integer")
    return int(word)


def real(word):
    if SPECIAL.fullmatch(word):
        return float(word)
    match = REAL.fullmatch(word)
    if not match:
        raise Refused(f"{word} is no number")
    return float(match[1] + b"e" + (match[2] or match[3] or b"0"))


def add(entries, row, column, value):
    entries.setdefault((row, column), []).append(value)


def place(words, rows, columns):
    if len(words) != 3:
        raise Refused("not three numbers")
    row, column, value = integer(words[0]), integer(words[1]), real(words[2])
    if not (1 <= row <= rows and 1 <= column <= columns):
        raise Refused("outside")
    return row, column, value


def matrix(text):
    """(rows, columns, {(row, column): values to be summed}); Refused where the text is none."""
    lines = lines_of(text)
    banner = [word.lower() for word in next(lines_of(text, comment=None), ())][:5]
    if len(banner) < 5 or banner[0] != b"%%matrixmarket" or banner[1] != b"matrix" or banner[2] not in (b"array", b"coordinate") \
            or banner[3] not in (b"real", b"integer", b"double") \
            or banner[4] not in (b"general", b"symmetric", b"hermitian", b"skew-symmetric"):
        raise Refused("banner")
    array, symmetry = banner[2] == b"array", banner[4]
    size = [integer(word) for word in next(lines, ())]
    if len(size) != (2 if array else 3) or min(size) < 0 or max(size[:2]) > MOST:
        raise Refused("size line")
    rows, columns = size[:2]
    if symmetry != b"general" and rows != columns:
        raise Refused("not square")
    sign = -1 if symmetry == b"skew-symmetric" else 1
    if array and rows*columns > len(text)*len(text):
        raise Refused("more than there can be")
    places = array_places(rows, columns, symmetry) if array else (None for _ in range(min(size[2], len(text) + 1)))
    entries = {}
    for where in places:
        words = next(lines, None)
        if words is None:
            raise Refused("ends early")
        if array:
            if len(words) != 1:
                raise Refused("not one number")
            row, column, value = *where, real(words[0])
        else:
            row, column, value = place(words, rows, columns)
        if sign < 0 and row == column and abs(value) > 0:
            raise Refused("skew-symmetric with a diagonal")
        add(entries, row, column, value)
        if symmetry != b"general" and row != column:
            add(entries, column, row, sign*value)
    if next(lines, None) is not None or (not array and size[2] > len(text)):
        raise Refused("more or less than announced")
    return rows, columns, entries


def array_places(rows, columns, symmetry):
    for column in range(1, columns + 1):
        start = {b"symmetric": column, b"hermitian": column, b"skew-symmetric": column + 1}.get(symmetry, 1)
        for row in range(start, rows + 1):
            yield row, column


def triplets(text):
    entries = {}
    for words in lines_of(text):
        add(entries, *place(words, MOST, MOST))
    if not entries:
        raise Refused("empty")
    n = max(max(place) for place in entries)
    if n > 2*sum(map(len, entries.values())):
        raise Refused("unknowns without entries")
    return n, n, entries


def shown(words):
    """(rows, columns, {(row, column): value}) of the words of an answer, and the words after it."""
    rows, columns, count = map(int, words[:3])
    entries = {(int(words[3 + 3*k]), int(words[4 + 3*k])): from_bits(words[5 + 3*k]) for k in range(count)}
    return (rows, columns, entries), words[3 + 3*count:]


def from_bits(word):
    return struct.unpack(">d", bytes.fromhex(word.decode()))[0]


def agree(expected, found):
    """Whether what was read is what the text says, but for the rounding of sums and zeros that are not kept."""
    if expected[:2] != found[:2]:
        return False
    sums = {place: (sum(values), sum(map(abs, values))) for place, values in expected[2].items()}
    return all(same(*sums.get(place, (0, 0)), found[2].get(place, 0)) for place in sums.keys() | found[2].keys())


def same(value, size, found):
    return found == value or (found != found and value != value) or abs(found - value) <= 1e-15*size
