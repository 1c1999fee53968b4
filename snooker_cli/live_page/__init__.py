"""The live page: a gas that runs in the browser, with the engine as WebAssembly, the same bits."""

from snooker_cli.live_page.page import engine_source, live_page, report_scene

__all__ = ["engine_source", "live_page", "report_scene"]
