"""What may be written over what, and how a file takes another's place."""

from __future__ import annotations

import errno
import ntpath
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from app.errors import UserError
from app.media.files import cannot_write, check_kept, name_from, replacing, takes_place
from app.media.inputs import state_of


def test_a_picture_is_named_by_the_way_to_it_and_on_another_drive_by_all_of_its_path(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert name_from(Path("/a/b"), Path("/a/c/d.png")) == "../c/d.png"
    monkeypatch.setattr(os.path, "relpath", ntpath.relpath)  # as it is on Windows
    assert name_from(Path("C:/a"), Path("D:/c/d.png")).endswith("/D:/c/d.png")


@pytest.mark.parametrize(
    ("output", "source", "does"),
    [
        ("f/a.png", "f/a.png", True),
        ("f/a.png", "g/a.png", False),
        ("f/a.%d.png", "f/a.7.png", True),
        ("f/a.%02d.png", "f/a.7.png", False),
        ("f/a.7.png", "f/a.%d.png", True),
        ("f/a.####.png", "f/a.%04d.png", True),
        ("f/a.%d.png", "f/a.%04d.png", True),
        ("f/a.%d.png", "f/b.%d.png", False),
    ],
)
def test_what_takes_the_place_of_what(output: str, source: str, does: bool) -> None:
    assert takes_place(output, source) is does


@pytest.mark.parametrize("change", ["another file", "its size", "its time"])
def test_a_file_is_told_from_what_stands_in_its_place_later_by_any_of_these_alone(tmp_path: Path, change: str) -> None:
    file, other = tmp_path / "a", tmp_path / "b"
    for path in (file, other):
        path.write_bytes(b"123")
        os.utime(path, ns=(7, 7))
    before = state_of(file)
    assert before is not None
    assert state_of(file) == before
    if change == "another file":
        other.replace(file)
    elif change == "its size":
        file.write_bytes(b"1234")
    os.utime(file, ns=(7, 8 if change == "its time" else 7))
    assert state_of(file) not in (None, before)
    file.unlink()
    assert state_of(file) is None


def test_a_result_is_not_written_over_its_source(tmp_path: Path) -> None:
    check_kept(tmp_path / "a.png", tmp_path / "b.png")
    with pytest.raises(UserError, match="would be replaced by its own result"):
        check_kept(tmp_path / "a.png", tmp_path / "x/../a.png")


@pytest.mark.parametrize("is_output", [False, True])
def test_nor_through_links_that_are_some_of_its_files(tmp_path: Path, is_output: bool) -> None:
    """Frames are published so: links to where they really are."""
    for name in ("links", "real"):
        (tmp_path / name).mkdir()
    (tmp_path / "real" / "a.0002.png").touch()
    (tmp_path / "links" / "b.0002.png").symlink_to("../real/a.0002.png")
    links, real, other = (tmp_path / name for name in ("links/b.%04d.png", "real/a.%04d.png", "real/c.%04d.png"))
    check_kept(other, links)
    check_kept(links, other)
    with pytest.raises(UserError, match="would be replaced by its own result"):
        check_kept(*((real, links) if is_output else (links, real)))


def test_a_name_in_other_capitals_is_the_same_file_where_the_disk_says_so(tmp_path: Path) -> None:
    """As on most disks of macOS and Windows; here two names of one file stand for that."""
    (source := tmp_path / "a.png").touch()
    (other := tmp_path / "A.PNG").touch()
    check_kept(source, other)
    check_kept(source, tmp_path / "A.png")
    other.unlink()
    os.link(source, other)
    with pytest.raises(UserError, match="would be replaced by its own result"):
        check_kept(source, other)
    os.link(source, tmp_path / "b.png")  # which is replaced alone
    check_kept(source, tmp_path / "b.png")


def test_a_folder_that_is_renamed_meanwhile_keeps_nothing_half_written(tmp_path: Path) -> None:
    """The temporary file stayed in it, hidden, as it was looked for where the folder had been."""
    folder, elsewhere = tmp_path / "folder", tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "a.png").write_bytes(b"before")
    said = f"^Cannot write {folder}/a.png: its folder is gone; make it again or choose another"

    def write() -> None:
        with replacing(folder / "a.png") as temporary:
            temporary.write_bytes(b"half")
            folder.rename(elsewhere)

    with pytest.raises(UserError, match=said):
        write()
    assert [(path.name, path.read_bytes()) for path in elsewhere.iterdir()] == [("a.png", b"before")]
    assert not folder.exists()


@pytest.mark.skipif(os.name == "nt", reason="there a folder cannot be opened")
def test_what_keeps_a_backup_outlasts_a_power_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The new file is on the disk before it takes the place of the old one, and then the folder that names it."""
    written: list[tuple[int, bytes]] = []
    sync, file = os.fsync, tmp_path / "a.png"
    file.write_bytes(b"before")
    monkeypatch.setattr(
        os, "fsync", lambda handle: (sync(handle), written.append((os.fstat(handle).st_ino, file.read_bytes())))
    )
    with replacing(file, backup=tmp_path / "a.bak") as temporary:
        temporary.write_bytes(b"after")
    assert written == [(file.stat().st_ino, b"before"), (tmp_path.stat().st_ino, b"after")]


def test_who_may_read_a_file_stays_so_when_it_is_replaced(tmp_path: Path) -> None:
    (file := tmp_path / "a.png").touch(0o600)
    file.chmod(0o640)
    with replacing(file) as temporary:
        temporary.write_bytes(b"new")
    assert file.read_bytes() == b"new"
    assert file.stat().st_mode & 0o777 == 0o640


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only the superuser gives files away")
def test_whose_a_file_is_stays_so_when_it_is_replaced(tmp_path: Path) -> None:
    """Or what root renders over an artist's file the artist cannot write any more; but no program of theirs is made."""
    (file := tmp_path / "a.png").touch()
    os.chown(file, 1234, 5678)
    file.chmod(0o6754)
    with replacing(file) as temporary:
        temporary.write_bytes(b"new")
    status = file.stat()
    assert (status.st_uid, status.st_gid, status.st_mode & 0o7777) == (1234, 5678, 0o754)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only the superuser becomes others")
def test_a_file_stays_with_its_group_when_one_of_them_replaces_it() -> None:
    """Who cannot give it back to its owner leaves it to the group that shares the folder."""
    code = """
import os
from app.media.files import replacing
os.setgroups([5678])
os.setgid(4321)
os.setuid(4321)
with replacing("a.png") as temporary:
    temporary.write_bytes(b"new")
"""
    with tempfile.TemporaryDirectory() as name:  # pytest's own is for root alone
        folder, file = Path(name), Path(name) / "a.png"
        file.touch()
        os.chown(file, 1234, 5678)
        file.chmod(0o664)
        folder.chmod(0o777)
        environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
        subprocess.run([sys.executable, "-c", code], check=True, cwd=folder, env=environment)
        status = file.stat()
    assert (status.st_uid, status.st_gid, status.st_mode & 0o7777) == (4321, 5678, 0o664)


def test_on_a_disk_without_modes_a_file_is_replaced_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    (file := tmp_path / "a.png").touch()
    monkeypatch.setattr(os, "chmod", refuse)
    with replacing(file) as temporary:
        temporary.write_bytes(b"new")
    assert file.read_bytes() == b"new"


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENOENT, "its folder is gone; make it again"),
        (errno.ENOSPC, "the disk is full"),
        (errno.EDQUOT, "quota is used up"),
        (errno.EROFS, "read-only"),
        (errno.ENAMETOOLONG, "the name is too long"),
        (errno.EFBIG, "grows larger than this disk allows"),
        (errno.EIO, "of its own"),
    ],
)
def test_why_a_file_cannot_be_written_is_told_with_what_mends_it(tmp_path: Path, number: int, said: str) -> None:
    assert said in str(cannot_write(tmp_path / "gone" / "a.png", OSError(number, "of its own")))
