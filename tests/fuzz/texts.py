"""Damaged texts: Matrix Market files, the same by a pipe, problems of them, and files of triplets.

Each is read by the library in one process with many others, and judged by matrix_market.py: what is accepted must be what
the text says, what the definition allows must be accepted.
"""
import random

import matrix_market
from cases import CRASHED, answers

# Codes of errors: bad input and, where a size is claimed that the text itself allows, no memory.
BAD_INPUT, NO_MEMORY = 2, 4
BATCH = 5000
HOWS = ("matrix", "matrix", "piped", "files", "triplets")
BANNER = b"%%MatrixMarket matrix coordinate real general\n"
TEXTS = (BANNER + b"3 3 5\n1 1 2.0\n2 2 1e0\n3 3 .5\n1 2 0\n3 1 -1.5D-3\n",
         BANNER.replace(b"general", b"symmetric") + b"% a comment\n4 4 5\n1 1 2\n2 1 -1\n2 2 2\n\n3 3 1+2\n4 4 1e-300\n",
         BANNER.replace(b"general", b"skew-symmetric") + b"3 3 2\r\n2 1 1.25\r\n3 2 7\r\n",
         b"%%matrixmarket MATRIX Array Real General\n2 3\n1\n2.5\n-0\n4e1\n5\n6\n",
         b"%%MatrixMarket matrix array integer symmetric\n3 3\n1\n0\n2\n3\n0\n4\n",
         BANNER + b"2 2 4\n1 1 1\n1 1 0.1\n1 1 0.2\n2 2 3\n")
TRIPLETS = (b"1 1 2.0\n2 2 1e0\n3 3 .5\n1 2 0\n3 1 -1.5D-3\n", b"% masses\n1 1 1\n\n2\t2\t2\n2 2 0.5\n")
TOKENS = (b"0", b"-1", b"1", b"2", b"3", b"7", b"+2", b"007", b"2147483646", b"2147483647", b"2147483648", b"-2147483648", b"4294967297",
          b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808", b"18446744073709551617", b"999999999999999999",
          b"99999999999999999999999999", b"1e999", b"1e-999", b"1d999", b"1d-999", b"1e99999999999", b"nan", b"-inf", b"Infinity", b"nan(1)",
          b"1.5D+2", b"1.5+2", b"0x10", b"1_000", b"3*1", b"1,5", b"+", b"-", b".", b"e5", b"1..2", b"1e", b"1e+", b"--1", b"%",
          b"%%MatrixMarket", b"complex", b"pattern", b"array", b"coordinate", b"symmetric", b"\x00", b"\x1b[2J", b"\x1a", b"\x7f",
          b"\xc2\x9b", b"\xff", b"\xef\xbb\xbf", b"", b"9"*400, b"x"*70000)
BYTES = (b"\n", b"\r", b"\r\n", b" ", b"\t", b"\x0b", b"\x00", b"\x1b", b"\x7f", b"\x80", b"\xff", b"%", b"-", b".", b"e", b"0", b"9")


def damaged(draw, text):
    for _ in range(draw.choice((1, 1, 1, 2, 2, 4, 8))):
        text = draw.choice((exchange_word, exchange_word, change_byte, change_byte, insert, remove, change_lines))(draw, text)
    return text[:draw.randrange(len(text) + 1)] if draw.random() < 0.05 else text


def exchange_word(draw, text):
    lines = text.split(b"\n")
    words = lines[(number := draw.randrange(len(lines)))].split(b" ")
    words[draw.randrange(len(words))] = draw.choice(TOKENS)
    lines[number] = b" ".join(words)
    return b"\n".join(lines)


def change_byte(draw, text):
    at = draw.randrange(len(text) + 1)
    byte = draw.choice((draw.choice(BYTES), bytes([draw.randrange(256)]), bytes([text[at] ^ 1 << draw.randrange(8)] if at < len(text) else b"")))
    return text[:at] + byte + text[at + 1:]


def insert(draw, text):
    at = draw.randrange(len(text) + 1)
    return text[:at] + draw.choice(BYTES + TOKENS) + text[at:]


def remove(draw, text):
    at = draw.randrange(len(text) + 1)
    return text[:at] + text[at + draw.randrange(1, 6):]


def change_lines(draw, text):
    lines = text.split(b"\n")
    one, other = draw.randrange(len(lines)), draw.randrange(len(lines))
    change = draw.randrange(3)
    if change == 0:
        lines[one], lines[other] = lines[other], lines[one]
    elif change == 1:
        lines.insert(one, lines[other])
    else:
        del lines[one]
    return b"\n".join(lines)


def make(seed, number):
    """How it is to be read, and the text."""
    draw = random.Random(f"text {seed} {number}")
    how = draw.choice(HOWS)
    how, text = how, damaged(draw, draw.choice(TRIPLETS if how == "triplets" else TEXTS))
    # A matrix alone may be as large and empty as it likes; a problem must not.
    if how in ("matrix", "piped") and is_large(text):
        how = "files"
    # A pipe holds 64 kB.
    return how, text[:60000] if how == "piped" else text


def is_large(text):
    try:
        return max(matrix_market.matrix(text)[:2]) > 100000
    except matrix_market.Refused:
        return False


def judge(how, text, answer):
    """What is wrong with an answer; empty where nothing is."""
    if answer.startswith(CRASHED):
        return answer.decode(errors="replace")
    words = answer.split()
    try:
        expected = (matrix_market.triplets if how == "triplets" else matrix_market.matrix)(text)
        problem = ""
    except matrix_market.Refused as refused:
        expected, problem = None, str(refused)
    if words[0] == b"error":
        if int(words[1]) != BAD_INPUT or not answer.split(b" ", 2)[2]:
            return f"refused by {answer[:200]}"
        if expected is not None and how in ("matrix", "piped") and not overflows(answer):
            return f"refused though right: {answer[:200]}"
        return ""
    if expected is None:
        return f"accepted, but {problem}"
    found, _ = matrix_market.shown(words[1:])
    return "" if matrix_market.agree(expected, found) else f"not what the text says: {found}, {expected}"


def overflows(answer):
    """Fortran refuses 1d999, which C takes for infinity."""
    return b"three numbers" in answer or b"one number" in answer


def run(arguments, folder):
    """Yields (name, bytes, what is wrong) for what fails."""
    for first in range(0, arguments.number, BATCH):
        batch = [make(arguments.seed, number) for number in range(first, min(first + BATCH, arguments.number))]
        for number, (case, answer) in enumerate(zip(batch, answers(arguments.reader, batch, folder))):
            wrong = judge(*case, answer)
            if wrong:
                yield f"{arguments.seed}-{first + number}.{case[0]}", case[1], wrong
