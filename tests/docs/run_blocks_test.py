#!/usr/bin/env python3
"""Tests run_blocks.py: which blocks it runs, leaves out and refuses.

  run_blocks_test.py

Exit: 0 if all holds; 1 if not.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

RUN_BLOCKS = pathlib.Path(__file__).parent / "run_blocks.py"


class RunBlocks(unittest.TestCase):
    def run_page(self, *blocks):
        """Of a page with these blocks: exit status, output, and messages."""
        with tempfile.TemporaryDirectory() as directory:
            page = pathlib.Path(directory) / "page.md"
            page.write_text("\n".join(f"```{block}\n```\n" for block in blocks))
            done = subprocess.run(
                [sys.executable, RUN_BLOCKS, page, directory],
                capture_output=True, text=True, check=False,
            )
        return done.returncode, done.stdout, done.stderr

    def test_runs_commands_in_order_with_the_files_of_the_page(self):
        status, output, _ = self.run_page("text file=a/words\nfine", "sh\ncat a/words")
        self.assertEqual(status, 0)
        self.assertEqual(output, "+ cat a/words\nfine\n")

    def test_ends_at_the_first_error(self):
        status, output, _ = self.run_page("sh\nexit 7", "sh\necho on")
        self.assertEqual(status, 7)
        self.assertNotIn("on\n", output)

    def test_leaves_out_what_is_marked(self):
        status, output, _ = self.run_page('sh not-run="it needs a screen"\nexit 7', "text\nexit 8")
        self.assertEqual((status, output), (0, ""))

    def test_refuses_what_is_not_marked_before_it_runs_anything(self):
        for block in ("\nls", "sh not-run\nls", 'sh not-run=""\nls', "json\n{}", "sh later\nls"):
            status, output, said = self.run_page("sh\necho on", block)
            self.assertEqual((status, output), (2, ""), block)
            self.assertIn("neither run nor marked", said)


unittest.main()
