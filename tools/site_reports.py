"""The reports of the tutorial as pages of the site, where ``tools/tutorial.py`` has made them: a hook of mkdocs."""

from __future__ import annotations

from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

REPORTS = Path(__file__).resolve().parent.parent / "logs" / "tutorial"
TUTORIAL = "tutorial.md"
EMBEDDED = """

## The reports themselves

{links}. Each is one file that opens without a network; the last of them:

<iframe src="{last}" title="the report of {verb}" style="width: 100%; height: 720px; border: 1px solid #8888"></iframe>
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Put the reports among the files of the site."""
    for report in sorted(REPORTS.glob("*.html")):
        files.append(File.generated(config, f"reports/{report.name}", abs_src_path=str(report)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Name them at the end of the tutorial, and show one. Without any the page is as it stands in docs."""
    names = [report.stem for report in sorted(REPORTS.glob("*.html"))]
    if page.file.src_uri != TUTORIAL or not names:
        return markdown
    links = ", ".join(f"[{name}](reports/{name}.html)" for name in names)
    return markdown + EMBEDDED.format(
        links=links[:1].upper() + links[1:], last=f"reports/{names[-1]}.html", verb=names[-1]
    )
