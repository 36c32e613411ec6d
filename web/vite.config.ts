import { defineConfig } from "vite";

// The bundle lies in the Python package, which serves it; relative addresses let it stand behind any path.
export default defineConfig({
  base: "./",
  build: {
    outDir: "../server/cohaptic_server/page",
    emptyOutDir: true,
    target: "es2022",
    // Inlined scripts and styles would need an unsafe content security policy.
    assetsInlineLimit: 0,
    // Whose code is in the bundle, and under which licence.
    license: { fileName: "licenses.txt" },
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
  },
  worker: { format: "es" },
  server: { port: 5173 },
});
