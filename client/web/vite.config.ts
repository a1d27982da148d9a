import { defineConfig, type Plugin } from 'vite';

// The policy that liquidblend-server sends with the page.
const contentSecurityPolicy = [
  "default-src 'none'",
  "script-src 'self' 'wasm-unsafe-eval'",
  "worker-src 'self'",
  "style-src 'self'",
  "img-src 'self' blob: data:",
  "connect-src 'self'",
  "font-src 'self'",
  "base-uri 'none'",
  "form-action 'none'",
  "frame-ancestors 'none'",
].join('; ');

const server = process.env.LIQUIDBLEND_HTTP ?? 'http://127.0.0.1:8080';

// Lets browsers fetch the decoder while they still read the scripts.
function preloadDecoder(): Plugin {
  return {
    name: 'preload-decoder',
    transformIndexHtml: {
      order: 'post',
      handler(_html, { bundle }) {
        const decoder = Object.keys(bundle ?? {}).find((file) => file.endsWith('.wasm'));
        if (!decoder) return [];
        const attrs = { rel: 'preload', as: 'fetch', crossorigin: true, href: `/${decoder}` };
        return [{ tag: 'link', attrs, injectTo: 'head' }];
      },
    },
  };
}

export default defineConfig({
  base: '/',
  plugins: [preloadDecoder()],
  build: {
    outDir: process.env.LIQUIDBLEND_PAGE ?? 'dist',
    emptyOutDir: true,
    target: 'es2022',
    assetsDir: 'page',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      output: {
        manualChunks: (id) => (id.includes('node_modules/three') ? 'three' : undefined),
      },
    },
  },
  worker: { format: 'es' },
  preview: {
    headers: { 'Content-Security-Policy': contentSecurityPolicy },
    proxy: { '/v1': { target: server, ws: true, changeOrigin: true, rewriteWsOrigin: true } },
  },
});
