"""Files of every kind that the command reads, and what may have happened to them, for test_campaign.py."""

import io
import math
import re
import struct
import zipfile
import zlib

from conftest import optional

np = optional("numpy")

SCENE = '[[material]]\nkind = "ggx"\nalpha = 0.3\nname = "grey"\n'
THREE = "".join(f'[[material]]\nkind = "ggx"\nalpha = {a}\nname = "m{i}"\n' for i, a in enumerate((0.2, 0.3, 0.5)))
RUN = 'budgets = [20, 40]\nmetrics = { pairs = 200, max_pairs = 1 }\n[[reconstruction]]\nkind = "nearest"\n' + SCENE


def readings_csv(rows, columns="theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value"):
    return (columns + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows)).encode()


def poses(lights=(15.0, 50.0)):
    """Readings by hand, of a lobe: angles in degrees and values."""
    around = [(o, p) for o in (5.0, 35.0, 65.0) for p in (180.0, 150.0, 95.0, 20.0)]
    value = lambda i, o, p: 0.1 + 2 * math.exp(-(((o - i) / 20) ** 2) - ((p - 180) / 60) ** 2)
    return [(i, 0.0, o, p, round(value(i, o, p), 6)) for i in lights for o, p in around]


def png(width=16, height=16):
    """Grey, of 16 bits."""
    chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rows = b"".join(b"\0" + struct.pack(f">{width}H", *((x * y * 97) % 65536 for x in range(width))) for y in range(height))
    head = struct.pack(">2I5B", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def npz(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def mine():
    rows = np.array(poses())
    light, sensor = (np.radians(rows[:, k : k + 2]).T for k in (0, 2))
    vectors = lambda t, p: np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], 1)
    return npz(omega_i=vectors(*light), omega_o=vectors(*sensor), value=rows[:, 4])


# Kind: the name of its file, its role, and its bytes: by the program (None), or by hand.
ZEMAX = b"""# a sample
Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\nSampleRotation 1\n0
AngleOfIncidence 2\n30 60\nScatterAzimuth 3\n0 90 180\nScatterRadial 3\n0 10 20\n\nMonochrome\nDataBegin
TIS 0.1\n.1 .2 .3\n.1 .4 .5\n.1 .6 .7\nTIS 0.1\n.11 .12 .13\n.11 .14 .15\n.11 .16 .17\nDataEnd\n"""
TREE = b"""<?xml version="1.0" encoding="UTF-8"?>\n<WindowElement>\n<WindowElementType>System</WindowElementType>
<Optical><Layer><Material><Name>a</Name></Material>
<DataDefinition><IncidentDataStructure>TensorTree3</IncidentDataStructure></DataDefinition>
<WavelengthData><LayerNumber>System</LayerNumber><Wavelength unit="Integral">Visible</Wavelength>
<WavelengthDataBlock><WavelengthDataDirection>Reflection Back</WavelengthDataDirection>
<AngleBasis>LBNL/Shirley-Chiu</AngleBasis><ScatteringDataType>BRDF</ScatteringDataType>
<ScatteringData>{.1 .2 .1 .2 .1 .2 .1 .2}</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>
"""
KINDS = {
    "csv": ("r.csv", "readings", None),
    "own csv": ("own.csv", "readings", lambda: readings_csv(poses())),
    "marks": ("marks.csv", "readings", lambda: readings_csv(poses()).replace(b",", b";").replace(b"0.1\n", b"n.a.\n")),
    "json lines": ("r.jsonl", "readings", None),
    "npz": ("r.npz", "readings", None),
    "own npz": ("own.npz", "readings", mine),
    "pab-opto": ("r.pab", "readings", None),
    "astm": ("r.astm", "readings", None),
    "alta": (
        "r.alta",
        "readings",
        lambda: b"#DIM 3 1\n#PARAM_IN ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n"
        + b"".join(b"%r\t%r\t%r\t%r\n" % (math.radians(o), math.radians(i), math.radians(p), v) for i, _, o, p, v in poses()),
    ),
    "schedule": ("s.csv", "schedule", None),
    "schedule npz": ("s.npz", "schedule", None),
    "schedule json": ("s.jsonl", "schedule", None),
    "config": ("m.toml", "config", lambda: SCENE.encode()),
    "run config": ("run.toml", "config", lambda: RUN.encode()),
    "instrument": ("cornell.toml", "instrument", None),
    "prior": ("p.gonio", "prior", None),
    "zemax": ("t.zbsdf", "table", lambda: ZEMAX),
    "tree": ("t.xml", "table", lambda: TREE),
    "utia": ("t.bin", "table", None),
    "rgl": ("t.bsdf", "table", None),
    "merl": ("t.binary", "binary", None),
    "mdl": ("t.mbsdf", None, None),
    "npy": ("a.npy", None, lambda: npz(a=np.zeros((3, 4)))[30:]),
    "height map": ("map.csv", "map", lambda: b"".join(b"0,%d,0.5,1,%d\n" % (k % 3, k % 2) for k in range(8))),
    "png": ("map.png", "map", png),
    "exr": ("sky.exr", "sky", None),
    "hdr": ("sky.hdr", "sky", lambda: b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + bytes((9, 8, 7, 129)) * 32),
}


def numbers(value, packed):
    """Puts a value in place of three numbers behind the head: in text, or of eight bytes in what is no text."""

    def damage(data, rng):
        if b"\0" in data[:4000]:
            data = bytearray(data)
            for _ in range(3):
                at = rng.randrange(len(data) // 10, max(len(data) // 10 + 1, len(data) - 8)) & ~7
                data[at : at + 8] = packed
            return bytes(data)
        found = list(re.finditer(rb"(?<![\w#.])-?\d*\.?\d+(?![\w.])", data))[2:]
        for hit in sorted(rng.sample(found, min(3, len(found))), key=lambda m: -m.start()):
            data = data[: hit.start()] + value + data[hit.end() :]
        return data

    return damage


def flip(share):
    def damage(data, rng):
        data = bytearray(data)
        at = min(len(data) - 1, int(len(data) * share) + rng.randrange(7))
        data[at] ^= 1 << rng.randrange(8)
        return bytes(data)

    return damage


def put(text, share=0.5):
    return lambda d, r: d[: int(len(d) * share)] + text + d[int(len(d) * share) :]


def lines(change):
    return lambda d, r: b"".join(change(d.splitlines(True)))


DAMAGES = {
    "empty": lambda d, r: b"",
    "one byte": lambda d, r: d[:1],
    "blank": lambda d, r: b"\n \n\t\n",
    **{f"cut at {share}": lambda d, r, share=share: d[: int(len(d) * share)] for share in (0.03, 0.2, 0.5, 0.9)},
    "cut at the end": lambda d, r: d[:-1],
    **{f"flip at {share}": flip(share) for share in (0, 0.004, 0.1, 0.3, 0.5, 0.7, 0.97)},
    "nul head": lambda d, r: bytes(16) + d[16:],
    "nul middle": put(bytes(64)),
    "other head": lambda d, r: b"\x89PNG\r\n\x1a\n" + d[8:],
    "zip head": lambda d, r: b"PK\x03\x04" + d[4:],
    "high head": lambda d, r: b"\xff" * 12 + d[12:],
    "1e999": numbers(b"1e999", struct.pack("<d", math.inf)),
    "huge": numbers(b"1e308", struct.pack("<d", 1e308)),
    "whole": numbers(b"99999999999999999999", struct.pack("<q", 2**62)),
    "nan": numbers(b"nan", struct.pack("<d", math.nan)),
    "below": numbers(b"-1e30", struct.pack("<d", -1e30)),
    "long line": put(b"7" * 1_000_000),
    "long word": put(b"x" * 1_000_000, 0.05),
    "deep": put(b"[" * 200_000, 0),
    "deep inside": put(b"{" * 100_000 + b"(" * 100_000),
    "bom": put(b"\xef\xbb\xbf", 0),
    "crlf": lambda d, r: d.replace(b"\n", b"\r\n"),
    "cr": lambda d, r: d.replace(b"\n", b"\r"),
    "utf-16": lambda d, r: d.decode("latin-1").encode("utf-16"),
    "latin-1": put(b"\xe9\xff"),
    "escapes": put(b"\x1b[31m\x1b]0;x\x07", 0.3),
    "escape head": put(b"\x1b[31m", 0),
    "twice": lambda d, r: d + d,
    "no head": lines(lambda all: all[1:]),
    "head alone": lines(lambda all: all[:1]),
    "turned": lines(lambda all: all[::-1]),
}


def members(change):
    """An archive again, of members that were changed: a list of names and bytes."""

    def damage(data, rng):
        with zipfile.ZipFile(io.BytesIO(data)) as old:
            all = [(name, old.read(name)) for name in old.namelist()]
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as new:
            for name, content in change(all):
                new.writestr(name, content)
        return file.getvalue()

    return damage


def array(text, body=b""):
    """A member whose header says what it likes."""
    text = text.encode() + b"\n"
    return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(text)) + text + body


def instead(text, body=b""):
    return members(lambda all: [(n, array(text, body) if n == "value.npy" else c) for n, c in all])


def flip_member(number):
    """A bit of the last number of a member, as it is stored."""

    def damage(data, rng):
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            all = archive.infolist()
        ends = [i.header_offset for i in all[1:]] + [data.index(b"PK\x01\x02")]
        data = bytearray(data)
        data[ends[number % len(all)] - 2] ^= 1 << rng.randrange(8)
        return bytes(data)

    return damage


SHAPE = "{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}"
# Of one kind each, by what it is made of.
OWN = {
    "npz": {
        **{f"{n} {b}": instead(SHAPE.format("<f8", b * n)) for n in (26, 60, 20_000) for b in "([{"},
        "nested type": instead(SHAPE.format("<f8", "(21,)").replace("'<f8'", "[" * 60 + "('a','<f8')" + "]" * 60)),
        "shape 2^62": instead(SHAPE.format("<f8", f"({2**62},)")),
        "shape 2^62 by 8": instead(SHAPE.format("<f8", f"({2**62}, 8)")),
        "shape -1": instead(SHAPE.format("<f8", "(-1,)")),
        "objects": instead(SHAPE.format("|O", "(21,)"), b"\x80\x04N."),
        "long text": instead(SHAPE.format("<U999999999", "(21,)")),
        "swollen": members(lambda all: [(n, c + bytes(50_000_000) if n == "value.npy" else c) for n, c in all]),
        **{f"flip of member {k}": flip_member(k) for k in range(0, 14, 2)},
        "twice the same": members(lambda all: all + all[-4:]),
        "names": members(lambda all: [(f"../{n}\x1b[31m", c) for n, c in all]),
        "no members": members(lambda all: []),
    },
    "toml": {
        "nested list": lambda d, r: b"a = " + b"[" * 100_000 + b"\n" + d,
        "nested table": lambda d, r: d + b"a = " + b"{ a = " * 50_000 + b"\n",
        "dotted key": lambda d, r: d + b"a." * 50_000 + b"a = 1\n",
        "dotted head": lambda d, r: d + b"[" + b"a." * 50_000 + b"a]\n",
        "nested sum": lambda d, r: d + b'[[material]]\nkind = "tabulated"\nof = ' + b'{ kind = "tabulated", of = ' * 60 + b"}" * 60,
    },
    "jsonl": {
        "nested list": lambda d, r: b'{"header":' + b"[" * 100_000 + b"]" * 100_000 + b"}\n" + d,
        "nested map": lambda d, r: d + b'{"a":' * 100_000 + b"1" + b"}" * 100_000 + b"\n",
    },
    "csv": {"nested comment": lambda d, r: b"# parametrization = " + b"[" * 100_000 + b"\n" + d},
    "xml": {
        "nested": lambda d, r: d.replace(b"<Optical>", b"<a>" * 100_000 + b"<Optical>"),
        "nested braces": lambda d, r: d.replace(b"{", b"{" * 100_000),
        "entities": lambda d, r: b'<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa">' + b"".join(
            b'<!ENTITY a%d "%s">' % (k, b"&a%s;" % (str(k - 1).encode() if k else b"") * 10) for k in range(12)
        ) + b"]>" + d.replace(b"<Name>a", b"<Name>&a11;"),
    },
    "gonio": {"nested": lambda d, r: b'{"gonio_prior":' + b"[" * 100_000 + b"\n" + d},
}
