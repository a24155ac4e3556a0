"""Links that somebody else put where exports go, and names that are paths."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.domain.models import InvalidInput
from app.failures import BadInput
from app.i18n import translation
from app.process.commands import export_target
from app.process.data_directory import DataDirectory
from app.services.files.file_access import draft_of, open_in_place, without_links
from tests.support.examples import first_of_each
from tests.support.process import configuration_of, is_one_line, prepared, run


@pytest.fixture
def shared(tmp_path) -> Path:
    """Like /tmp."""
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    return shared


@pytest.fixture
def logs(shared) -> Path:
    """A directory in it."""
    (shared / "logs").mkdir()
    return shared / "logs"


@pytest.fixture
def precious(tmp_path) -> Iterator[Path]:
    """A file that somebody wants to have written over; nothing else gets into its directory either."""
    precious = tmp_path / "home" / "precious"
    precious.parent.mkdir()
    precious.write_text("precious", encoding="utf-8")
    yield precious
    assert [(path.name, path.read_text(encoding="utf-8")) for path in precious.parent.glob("*")] == [
        ("precious", "precious")
    ]


def write(path: Path) -> None:
    with export_target(str(path)) as target:
        target.write("log")


def test_a_link_in_a_shared_directory_is_not_followed(shared, precious):
    link = shared / "log.csv"
    link.symlink_to(precious)
    with pytest.raises(BadInput, match=f"{link} is a link or a pipe that somebody else may have put there"):
        write(link)


def test_nor_is_one_of_a_directory_or_behind_another_link(shared, precious, tmp_path):
    (shared / "logs").symlink_to(precious.parent)
    with pytest.raises(BadInput):
        write(shared / "logs" / "precious")
    (shared / "log.csv").symlink_to(precious)
    own, loop = tmp_path / "own", tmp_path / "loop"
    own.symlink_to(shared / "log.csv")
    with pytest.raises(BadInput):
        write(own)
    loop.symlink_to("loop")
    with pytest.raises(BadInput, match="leads nowhere"):
        write(loop)


def of_somebody_else(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only root can change a file's owner; other users change theirs instead."""
    if os.geteuid() == 0:
        os.lchown(path, 1234, 1234)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: path.lstat().st_uid + 1)


@pytest.mark.parametrize("mode", [0o755, 0o775, 0o1777])
def test_a_link_of_somebody_else_is_not_followed_in_any_place(logs, shared, precious, mode, monkeypatch):
    """Also in a directory of the other user, and in one of a group."""
    (logs / "log.csv").symlink_to(precious)
    (logs / "home").symlink_to(precious.parent)
    logs.chmod(mode)
    for link in (logs / "log.csv", logs / "home"):
        of_somebody_else(link, monkeypatch)
    for target in (
        logs / "log.csv",
        logs / "home" / "precious",
        logs / "home" / ".." / "home" / "new",
        shared / ".." / "shared" / "logs" / "log.csv",
    ):
        with pytest.raises(BadInput, match="somebody else may have put there"):
            write(target)


def test_nor_is_one_on_the_way_behind_an_own_link(shared, precious, tmp_path):
    (shared / "logs").symlink_to(precious.parent)
    (tmp_path / "mine").symlink_to(shared)
    with pytest.raises(BadInput, match="somebody else may have put there"):
        write(tmp_path / "mine" / "logs" / "precious")


@pytest.mark.parametrize("mode", [0o755, 0o775])
def test_own_links_are_followed(logs, shared, tmp_path, mode):
    logs.chmod(mode)
    (tmp_path / "mine").mkdir()
    (logs / "home").symlink_to("../../mine")
    (logs / "log.csv").symlink_to(logs / "home" / "log")
    write(logs / "log.csv")
    assert (tmp_path / "mine" / "log").read_text(encoding="utf-8") == "log"
    assert (logs / "log.csv").is_symlink()


def test_a_file_that_becomes_a_link_after_the_check_is_not_followed(logs, shared, precious):
    for name in ("precious", "pipe"):
        assert without_links(logs / name) == logs / name
    (logs / "precious").symlink_to(precious)
    with draft_of(logs / "precious") as file:
        file.write("log")
    assert (logs / "precious").read_text(encoding="utf-8") == "log"  # the link itself was replaced
    (logs / "pipe").symlink_to(precious)
    with pytest.raises(OSError, match="Too many levels"):
        open_in_place(logs / "pipe")
    logs.rename(shared / "away")
    logs.symlink_to(precious.parent)
    with pytest.raises(OSError, match="Not a directory"), draft_of(logs / "precious") as file:
        file.write("log")
    for name in ("precious", "pipe"):
        with pytest.raises(OSError, match="Not a directory"):
            open_in_place(logs / name)
    with pytest.raises(FileExistsError):  # nor is a file emptied that was a pipe
        open_in_place(precious)


def test_a_directory_that_becomes_a_link_while_it_is_written_gets_nothing(logs, shared, precious):
    with draft_of(logs / "precious") as file:
        file.write("log")
        logs.rename(shared / "away")
        logs.symlink_to(precious.parent)
    assert [path.name for path in (shared / "away").iterdir()] == ["precious"]


def test_the_pipe_of_another_command_is_written_into(tmp_path):
    """As a shell writes ``--export-log >(gzip)``."""
    reader, writer = os.pipe()
    for name in (f"/dev/fd/{writer}", f"/proc/self/fd/{writer}"):
        write(Path(name))
        assert os.read(reader, 100) == b"log"
    os.close(reader)
    os.close(writer)


def test_a_pipe_there_gets_nothing(shared):
    os.mkfifo(shared / "log.csv")
    with pytest.raises(BadInput):
        write(shared / "log.csv")


def test_plain_files_there_are_written(shared):
    write(shared / "log.csv")
    write(shared / "log.csv")
    assert (shared / "log.csv").read_text(encoding="utf-8") == "log"


def test_an_export_on_screen_follows_none_either(container, shared, precious):
    (shared / "logs").symlink_to(precious.parent)
    (shared / "log.csv").symlink_to(precious.parent / "new")
    for export in (container.files.export_history, container.files.export_configuration):
        for target in (shared / "logs" / "log.csv", shared / "log.csv"):
            with pytest.raises(InvalidInput, match="somebody else may have put"):
                export(str(target))


# ---------------------------------------------------------------------- data directories that somebody else prepared
@pytest.fixture
def prepared_by_others(tmp_path, precious) -> Path:
    directory = tmp_path / "prepared"
    (directory / "logs").mkdir(parents=True)
    for name in ("scheduler.lock", "amr-scheduler.db", "logs/amr-scheduler.log"):
        (directory / name).symlink_to(precious)
    return directory


def contents(directory: Path) -> dict[str, str]:
    return {
        str(path.relative_to(directory)): os.readlink(path) if path.is_symlink() else ""
        for path in directory.rglob("*")
    }


@pytest.mark.parametrize("read_only", [False, True])
def test_the_directory_of_another_user_is_refused(prepared_by_others, precious, monkeypatch, read_only):
    before = contents(prepared_by_others)
    prepared_by_others.chmod(0o777)
    monkeypatch.setattr(os, "geteuid", lambda: prepared_by_others.stat().st_uid + 1)
    with pytest.raises(BadInput, match="belongs to another user"):
        DataDirectory.prepare(prepared_by_others, read_only=read_only)
    assert prepared_by_others.stat().st_mode & 0o777 == 0o777
    assert contents(prepared_by_others) == before


def test_a_data_directory_with_the_sticky_bit_is_refused(shared):
    (shared / "scheduler.lock").touch()
    with pytest.raises(BadInput, match="shared by several users"):
        DataDirectory.prepare(shared)
    assert shared.stat().st_mode & 0o7777 == 0o1777


COMMANDS = (("--headless",), ("--export-config", "-"), ("--export-log", "-"), ("--remove-pin",))
PLANTED = ("scheduler.lock", "amr-scheduler.db", "logs/amr-scheduler.log")


@pytest.mark.parametrize(
    ("arguments", "planted"),
    first_of_each({f"{name}{arguments[0]}": (arguments, name) for arguments in COMMANDS for name in PLANTED}),
)
def test_no_link_that_was_planted_in_ones_own_is_followed(prepared_by_others, precious, arguments, planted):
    for name in contents(prepared_by_others).keys() - {planted, "logs"}:
        (prepared_by_others / name).unlink()
    if "log" in planted:
        prepared(prepared_by_others, configuration_of())
    done = run(prepared_by_others, *arguments)
    reads_all_the_same = "log" in planted and arguments[0].startswith("--export")
    assert (done.returncode in (1, 2), is_one_line(done.stderr)) == (not reads_all_the_same,) * 2, done


def test_a_language_is_a_name_and_no_path(container, tmp_path):
    planted = tmp_path / "planted" / "LC_MESSAGES"
    planted.mkdir(parents=True)
    (planted / "amr.po").write_text(
        'msgid ""\nmsgstr ""\n"Content-Type: text/plain; charset=UTF-8\\n"\n\nmsgid "Save"\nmsgstr "Evil"\n',
        encoding="utf-8",
    )
    for language in (str(planted.parent), os.path.relpath(planted.parent, Path(__file__).parents[2] / "locale")):
        assert translation(language).gettext("Save") == "Save"
        with pytest.raises(InvalidInput):
            container.catalogue.change_settings(language=language)
    assert container.catalogue.change_settings(language="fi").language == "fi"
