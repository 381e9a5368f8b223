"""A notebook as a page: its cells in order, with what they show."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

PNG = "image/png"
TEXT = "text/plain"


def markdown_of(path: Path) -> str:
    """Return the notebook at `path` as Markdown, its pictures in it."""
    notebook = json.loads(path.read_text("utf-8"))
    parts: list[str] = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        parts += [_shown(output) for output in cell["outputs"]]
    return "\n\n".join(parts) + "\n"


def _shown(output: dict[str, Any]) -> str:
    data = output.get("data", {TEXT: output.get("text", "")})
    if PNG in data:
        encoded = "".join(data[PNG]).replace("\n", "")
        return f'<img alt="What the cell above shows" src="data:{PNG};base64,{encoded}">'
    text = "".join(data[TEXT])
    return f"```text\n{text.rstrip()}\n```"
