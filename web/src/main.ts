/** Where the page begins. */
document.body.textContent = "cohaptic";
