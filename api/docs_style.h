/// Style sheet of the API page.
#pragma once

#include <string_view>

namespace api {

inline constexpr std::string_view kDocsStyle = R"css(
:root {
  color-scheme: light dark;
  --paper: #fbfaf7; --raised: #ffffff; --ink: #1d2328; --soft: #5d676f; --line: #dfddd5;
  --accent: #9a4a12; --code: #f2f0ea;
  --get: #1f6f5c; --post: #8a4b0f; --put: #5b4aa0; --patch: #7a5c00; --delete: #a3302b;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171a; --raised: #1b1f23; --ink: #e6e3dc; --soft: #9aa3aa; --line: #30363b;
    --accent: #f0a868; --code: #22272c;
    --get: #69c9ae; --post: #eea55f; --put: #b3a5f0; --patch: #dcc05a; --delete: #f08a83;
  }
}
* { box-sizing: border-box; }
html { scroll-behavior: smooth; scroll-padding-top: 1rem; }
@media (prefers-reduced-motion: reduce) { html { scroll-behavior: auto; } }
body {
  margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif;
}
a { color: var(--accent); text-decoration-thickness: 1px; text-underline-offset: 2px; }
a:focus-visible, summary:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
code, pre { font: 0.875em/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
code { overflow-wrap: anywhere; }
pre {
  background: var(--code); border: 1px solid var(--line); border-radius: 6px;
  padding: 0.75rem 1rem; overflow-x: auto; margin: 0.75rem 0;
}
.page {
  display: grid; grid-template-columns: 17rem minmax(0, 1fr); max-width: 84rem; margin: 0 auto;
}
nav {
  position: sticky; top: 0; height: 100vh; overflow-y: auto; padding: 2rem 1rem 2rem 1.5rem;
  border-right: 1px solid var(--line); font-size: 0.875rem;
}
nav .name { font-size: 1.125rem; font-weight: 650; color: var(--ink); text-decoration: none; }
nav h2 { margin: 1.5rem 0 0.375rem; font-size: 0.875rem; font-weight: 650; border: 0; padding: 0; }
nav ul { list-style: none; margin: 0; padding: 0; }
nav li a { display: block; padding: 0.1875rem 0; color: var(--soft); text-decoration: none; }
nav li a:hover { color: var(--ink); text-decoration: underline; }
main { padding: 2rem clamp(1rem, 4vw, 3.5rem) 6rem; min-width: 0; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 0.5rem; letter-spacing: -0.01em; }
h2 {
  font-size: 1.5rem; margin: 3.5rem 0 0.25rem; padding-top: 1rem; border-top: 1px solid var(--line);
}
h3 { font-size: 1.125rem; margin: 0; }
h4 { font-size: 0.9375rem; margin: 1.25rem 0 0.25rem; }
p { margin: 0.5rem 0; max-width: 46rem; }
.soft { color: var(--soft); }
article {
  background: var(--raised); border: 1px solid var(--line); border-radius: 8px;
  padding: 1.125rem 1.375rem; margin: 1.25rem 0;
}
.route {
  display: flex; flex-wrap: wrap; gap: 0.25rem 0.75rem; align-items: baseline; margin: 0.25rem 0;
}
.method { font-weight: 700; min-width: 3.25rem; }
.get { color: var(--get); } .post { color: var(--post); } .put { color: var(--put); }
.patch { color: var(--patch); } .delete { color: var(--delete); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: 0.9375rem; margin: 0.25rem 0; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 0.8125rem; }
th, td {
  padding: 0.375rem 0.75rem 0.375rem 0; border-bottom: 1px solid var(--line); vertical-align: top;
}
tr:last-child td { border-bottom: 0; }
td:first-child { white-space: nowrap; width: 1%; padding-right: 1.5rem; }
nav code { font-size: 0.6875rem; font-weight: 700; }
td .facts code { font-size: 1em; }
td .facts { display: block; color: var(--soft); font-size: 0.8125rem; }
details { margin: 0.75rem 0 0; }
summary { cursor: pointer; color: var(--soft); font-size: 0.9375rem; }
details[open] > summary { color: var(--ink); }
@media (max-width: 54rem) {
  .page { grid-template-columns: minmax(0, 1fr); }
  nav { position: static; height: auto; border-right: 0; border-bottom: 1px solid var(--line); }
  nav ul { columns: 2; }
  td:first-child { white-space: normal; width: auto; }
}
@media print { nav { display: none; } .page { display: block; } article { break-inside: avoid; } }
)css";

}  // namespace api
