import { defineConfig } from "vitest/config";

// A file of its own: who only builds the page has no vitest (hatch_build.py).
export default defineConfig({
  // A machine that does much else at once is slow, not wrong.
  test: { include: ["tests/**/*.test.ts"], environment: "node", testTimeout: 60_000 },
});
