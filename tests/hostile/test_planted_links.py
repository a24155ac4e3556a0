"""Links that somebody else put where exports go, and names that are paths."""
from __future__ import annotations

import os
from pathlib import Path

import pytest

from app.container import Container
from app.domain.models import InvalidInput
from app.failures import BadInput
from app.i18n import translation
from app.process.commands import ExportTarget
from tests.support.process import is_one_line, run


@pytest.fixture
def shared(tmp_path) -> Path:
    """Like /tmp."""
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    return shared


@pytest.fixture
def precious(tmp_path) -> Path:
    precious = tmp_path / "home" / "precious"
    precious.parent.mkdir()
    precious.write_text("precious", encoding="utf-8")
    return precious


def write(path: Path) -> None:
    with ExportTarget(str(path)) as target:
        target.write("log")


def test_a_link_in_a_shared_directory_is_not_followed(shared, precious):
    link = shared / "log.csv"
    link.symlink_to(precious)
    with pytest.raises(BadInput, match=f"{link} is a link or a pipe in a directory in which others may write"):
        write(link)
    assert precious.read_text(encoding="utf-8") == "precious"


def test_the_command_says_so_in_one_line(shared, precious, tmp_path):
    link = shared / "log.csv"
    link.symlink_to(precious)
    for option in ("--export-log", "--export-config"):
        done = run(tmp_path / "data", option, link)
        assert done.returncode == 2
        assert is_one_line(done.stderr)
    assert precious.read_text(encoding="utf-8") == "precious"


def test_nor_is_one_of_a_directory_or_behind_another_link(shared, precious):
    (shared / "logs").symlink_to(precious.parent)
    with pytest.raises(BadInput):
        write(shared / "logs" / "precious")
    (shared / "log.csv").symlink_to(precious)
    own = precious.parent / "own"
    own.symlink_to(shared / "log.csv")
    with pytest.raises(BadInput):
        write(own)
    (precious.parent / "loop").symlink_to("loop")
    with pytest.raises(BadInput, match="leads nowhere"):
        write(precious.parent / "loop")
    assert precious.read_text(encoding="utf-8") == "precious"


def test_a_pipe_there_gets_nothing(shared):
    os.mkfifo(shared / "log.csv")
    with pytest.raises(BadInput):
        write(shared / "log.csv")


def test_plain_files_there_are_written(shared):
    write(shared / "log.csv")
    write(shared / "log.csv")
    assert (shared / "log.csv").read_text(encoding="utf-8") == "log"


def test_an_export_on_screen_follows_none_either(shared, precious, tmp_path):
    container = Container.open(tmp_path / "data")
    (shared / "logs").symlink_to(precious.parent)
    (shared / "log.csv").symlink_to(precious.parent / "new")
    for export in (container.files.export_history, container.files.export_configuration):
        for target in (shared / "logs" / "log.csv", shared / "log.csv"):
            with pytest.raises(InvalidInput, match="others may write"):
                export(str(target))
    container.close()
    assert [path.name for path in precious.parent.iterdir()] == ["precious"]


def test_a_language_is_a_name_and_no_path(tmp_path):
    container = Container.open(tmp_path / "data")
    planted = tmp_path / "planted" / "LC_MESSAGES"
    planted.mkdir(parents=True)
    (planted / "amr.po").write_text('msgid ""\nmsgstr ""\n"Content-Type: text/plain; charset=UTF-8\\n"\n\nmsgid "Save"\nmsgstr "Evil"\n',
                                    encoding="utf-8")
    for language in (str(planted.parent), os.path.relpath(planted.parent, Path(__file__).parents[2] / "locale")):
        assert translation(language).gettext("Save") == "Save"
        with pytest.raises(InvalidInput):
            container.catalogue.change_settings(language=language)
    assert container.catalogue.change_settings(language="fi").language == "fi"
    container.close()
