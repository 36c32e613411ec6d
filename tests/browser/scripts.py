"""What a visitor has the page run."""

from __future__ import annotations

# A page that never loaded has no storage.
ENGINEER = "try { localStorage.setItem('cohaptic.engineer', 'yes') } catch {}"
# In one look: what is seen may be gone before a second, which would wait for it to come again.
TEXT = """
([first]) => {
  if (first === undefined) return "";
  const { width, height } = first.getBoundingClientRect();
  const seen = width > 0 && height > 0 && getComputedStyle(first).visibility === "visible";
  return seen ? first.innerText : "";
}
"""
VIOLATIONS = """
addEventListener("securitypolicyviolation", (e) => {
  console.error("policy: " + e.violatedDirective + " " + e.blockedURI);
});
"""
# In the second frame from now the page has done all that it does for the first.
TWO_FRAMES = """
() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))
"""
