"""Template of a report's page."""

from string import Template

PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light dark; --text: #222; --soft: #666; --line: #ddd; --card: #f5f6f8;
  --page: #fff; --loss: #fff4e0; }
@media (prefers-color-scheme: dark) {
  :root { --text: #ddd; --soft: #9aa0a6; --line: #3a3d42; --card: #24272b; --page: #17191c;
    --loss: #3a2f1a; }
  img { filter: invert(0.9) hue-rotate(180deg); }
}
body { font: 15px/1.5 system-ui, sans-serif; color: var(--text); background: var(--page);
  max-width: 1000px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: 0; }
h2 { font-size: 1.2em; margin: 1.6em 0 0; border-bottom: 1px solid var(--line); }
h3 { font-size: 1em; margin: 0.8em 0 0.3em; }
.about, small { color: var(--soft); overflow-wrap: anywhere; }
.about { margin: 0.2em 0 0.6em; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(175px, 1fr)); gap: 10px; }
.tile { border-left: 5px solid #2a9d4a; background: var(--card); padding: 8px 12px; }
.tile h3 { margin: 0; color: var(--soft); font-weight: normal; }
.tile b { font-size: 1.15em; }
.tile p { margin: 0; font-size: 0.85em; color: var(--soft); }
.tile.warning { border-color: #e0a000; }
.tile.error { border-color: #d03030; }
.losses { background: var(--loss); padding: 4px 14px; margin-top: 1em; }
.figure { display: block; overflow-x: auto; margin: 1em 0; }
.figure input { display: none; }
.figure img { display: block; width: 100%; max-width: 990px; cursor: zoom-in; }
.figure input:checked + img { width: 1980px; max-width: none; cursor: zoom-out; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; }
td, th { padding: 3px 8px; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: top; }
.number { font-variant-numeric: tabular-nums; text-align: right; }
td.number { white-space: nowrap; }
.group td { font-weight: bold; background: var(--card); }
small { display: block; }
tr.warning td:first-child { border-left: 4px solid #e0a000; }
tr.error td:first-child { border-left: 4px solid #d03030; }
tr.ok td:first-child { border-left: 4px solid #2a9d4a; }
@media (max-width: 600px) {
  body { margin: 1em auto; padding: 0 0.6em; font-size: 14px; }
  td, th { padding: 3px 4px; }
  td { overflow-wrap: break-word; }
  .event { display: grid; grid-template-columns: auto 1fr auto; }
  .event td { border-bottom: 0; }
  .event td:last-child { grid-column: 1 / -1; border-bottom: 1px solid var(--line); }
}
</style>
</head>
<body>
<h1>$title</h1>
$summaries
$losses
<h2>What happened when</h2>
$modes
$events
<h2>Figures</h2>
<p class="about">A click enlarges one, another makes it small again.</p>
$figures
<h2>Metrics</h2>
$table
<p class="about">Not known from what was recorded: $unknown.</p>
</body>
</html>
""")
