"""What MkDocs calls as it builds the site: pages from elsewhere, and links out of docs/."""

from __future__ import annotations

import re

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from docs.site import reference
from docs.site.links import PLACES, ROOT, TUTORIAL, linked
from docs.site.notebook import markdown_of

GENERATED = {
    "commands.md": reference.commands,
    "settings.md": reference.settings,
    "messages.md": reference.messages,
}
_LOADED = re.compile(r"<(?:script|img|iframe)[^>]+src=\"?(?:https?:)?//[^>]*>")
_STYLE = re.compile(r"<link[^>]+stylesheet[^>]+href=\"?(?:https?:)?//[^>]*>")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are written from files outside of docs/, and from the code."""
    for source, place in PLACES.items():
        path = ROOT / source
        text = markdown_of(path) if source == TUTORIAL else path.read_text("utf-8")
        files.append(File.generated(config, place, content=text))
    for place, generate in GENERATED.items():
        files.append(File.generated(config, place, content=generate()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links lead to pages. Raises PluginError for one to a file that does not exist."""
    try:
        return linked(markdown, page.file.src_uri)
    except ValueError as error:
        raise PluginError(str(error)) from None


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Raise PluginError for a page that loads something from another host: it would not show
    without it.
    """
    for element in [*_LOADED.findall(output), *_STYLE.findall(output)]:
        raise PluginError(f"{page.file.src_uri} loads from another host: {element}")
    return output
