"""Template of a report's page."""

from string import Template

PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1000px; margin: 2em auto;
  padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: 0; }
h2 { font-size: 1.2em; margin: 1.6em 0 0; border-bottom: 1px solid #ddd; }
h3 { font-size: 1em; margin: 0.8em 0 0.3em; }
.about, small { color: #666; }
.about { margin: 0.2em 0 0.6em; overflow-wrap: anywhere; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(175px, 1fr)); gap: 10px; }
.tile { border-left: 5px solid #2a9d4a; background: #f6f7f8; padding: 8px 12px; }
.tile h3 { margin: 0; color: #666; font-weight: normal; }
.tile b { font-size: 1.15em; }
.tile p { margin: 0; font-size: 0.85em; color: #666; }
.tile.warning { border-color: #e0a000; }
.tile.error { border-color: #d03030; }
.losses { background: #fff4e0; padding: 4px 14px; margin-top: 1em; }
img { display: block; width: 100%; max-width: 990px; margin: 1em 0; }
table { border-collapse: collapse; width: 100%; }
td, th { padding: 3px 8px; border-bottom: 1px solid #eee; text-align: left; vertical-align: top; }
.number { font-variant-numeric: tabular-nums; text-align: right; }
td.number { white-space: nowrap; }
.group td { font-weight: bold; background: #f0f2f4; }
small { display: block; }
tr.warning td:first-child { border-left: 4px solid #e0a000; }
tr.error td:first-child { border-left: 4px solid #d03030; }
tr.ok td:first-child { border-left: 4px solid #2a9d4a; }
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
$figures
<h2>Metrics</h2>
$table
<p class="about">Not known from what was recorded: $unknown.</p>
</body>
</html>
""")
