"""YAML text and files: which values are read, and which files cannot be read."""

import math
import os
import re
from pathlib import Path

import pytest
from config_texts import BASE, config

from snooker_cli.config import ConfigError, load, yaml_document
from snooker_cli.config.yaml_document import document


def test_scalars_are_those_of_yaml_1_2() -> None:
    text = "1e7 1E+7 .5 5. +3 010 0o10 0x1F .inf +.INF -.Inf null ~ True FALSE no on 1:30 1_000 nan"
    values = [1e7, 1e7, 0.5, 5.0, 3, 10, 8, 31, math.inf, math.inf, -math.inf, None, None, True]
    values += [False, "no", "on", "1:30", "1_000", "nan", None]
    read = document("\n".join(f"- {written}" for written in [*text.split(), ""]), "")
    assert repr(read.data) == repr(values)
    assert repr(config(BASE.replace("500", "5e2")).collisions) == "500"


def test_byte_order_mark_windows_line_ends_and_markers_are_harmless(tmp_path: Path) -> None:
    path = tmp_path / "run.yaml"
    path.write_bytes(b"\xef\xbb\xbf---\r\n" + BASE.replace("\n", "\r\n").encode() + b"...\r\n")
    assert load(path).config == config()
    assert load(str(path), ["seed=3"]).config == config(BASE, "seed=3")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    """A pipe without a writer never ends, and a device may have no end."""
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "latin.yaml").write_bytes(b"title: caf\xe9\n")
    (tmp_path / "large.yaml").write_bytes(BASE.encode() + b"#" * (1 << 20))
    for name in (tmp_path / "absent.yaml", tmp_path / "pipe.yaml", "/dev/zero", "a\0b"):
        with pytest.raises(ConfigError, match="there is no file"):
            load(name)
    with pytest.raises(ConfigError, match="byte 11 is not UTF-8 text"):
        load(tmp_path / "latin.yaml")
    with pytest.raises(ConfigError, match="the file is over 512 KiB"):
        load(tmp_path / "large.yaml")


def test_a_run_or_folder_given_as_a_config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("configs", "runs/decay", "runs/other"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "configs" / "decay.yaml").write_text(BASE, encoding="utf-8")
    meant = re.escape("; did you mean configs/decay.yaml?")
    for name in ("runs/decay", "runs/decay/", "configs"):
        with pytest.raises(
            ConfigError, match=f"{name}: this is a folder, not a config file{meant}"
        ):
            load(name)
    for name in ("decay", "decay.yaml", "configs/dcay.yaml"):
        with pytest.raises(ConfigError, match=f"{name}: there is no file at this path{meant}"):
            load(name)
    for name in (".", "runs/other", "configs/gas.yaml"):
        with pytest.raises(ConfigError, match=r"; name a config file \(YAML\)$"):
            load(name)


def test_large_texts_are_read_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """By libyaml, with the same data and positions; a mistake has a position too."""
    ball = '  - {position: [1.0, -2], velocity: [0, 1e3], radius: 0x1}  # "ä"\n'
    text = "cor: 1\ntitle: ü\nballs:\n" + 1000 * ball
    found = []
    for large in (0, len(text)):
        monkeypatch.setattr(yaml_document, "LARGE", large)
        found.append(document(text, "a.yaml"))
    assert found[0] == found[1]
    monkeypatch.setattr(yaml_document, "LARGE", 0)
    for wrong, part in (("cor: [1", ":100[45]:"), ("{a: 1} b: 2", ":1004:")):
        with pytest.raises(ConfigError, match=part):
            document(text + wrong, "a.yaml")
