"""The CSS of the report, with one set of variables for light and one for dark."""

CSS = """
:root{color-scheme:light dark;--bg:#f5f6f8;--card:#fff;--ink:#14181f;--soft:#5a6472;--line:#dfe3e8;--grid:#e9ecf0;
  --blue:#2567c9;--wash:#2567c926;--contact:#d2452c;--truth:#16834a;--good:#16834a;--bad:#c5352b;--warn:#a86400;
  --idle:#98a1ad;--path:#8c97a6;--t0:#2567c9;--t1:#e08a1e;--t2:#16937a;--t3:#8a55c7;--t4:#c4437f;--t5:#6b7787}
@media (prefers-color-scheme:dark){:root{--bg:#0f1217;--card:#181c23;--ink:#e8ebf0;--soft:#9aa5b4;--line:#2b323c;
  --grid:#252b34;--blue:#6ea8ff;--wash:#6ea8ff2e;--contact:#ff7d62;--truth:#4cc585;--good:#4cc585;--bad:#ff7468;
  --warn:#e6a94a;--idle:#6a7584;--path:#6f7b8b;--t0:#6ea8ff;--t1:#f0a94e;--t2:#44c2a6;--t3:#b58cf0;--t4:#ee7fb0;
  --t5:#95a1b1}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);
  font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans", sans-serif;-webkit-text-size-adjust:100%}
main{max-width:1120px;margin:0 auto;padding:28px 20px 60px}
header,section{background:var(--card);border:1px solid var(--line);border-radius:12px;padding:22px 26px;
  margin-bottom:18px}
header{border-top:5px solid var(--idle)}
header.good{border-top-color:var(--good)}
header.bad{border-top-color:var(--bad)}
header.warn{border-top-color:var(--warn)}
h1{font-size:27px;line-height:1.2;margin:2px 0 6px;letter-spacing:-.01em}
h2{font-size:18px;margin:0 0 2px;letter-spacing:-.005em}
h3{font-size:15px;margin:22px 0 8px}
h3 small{font-weight:400;color:var(--soft);margin-left:8px}
.over{font-size:12px;letter-spacing:.07em;text-transform:uppercase;color:var(--soft);margin:0}
.good .verdict{color:var(--good)}
.bad .verdict{color:var(--bad)}
.warn .verdict{color:var(--warn)}
.facts{color:var(--soft);margin:0;display:flex;flex-wrap:wrap}
.facts b{color:var(--ink);font-weight:600}
.facts span{margin-right:20px;white-space:nowrap}
.results{margin:12px 0 0;padding-left:20px;font-size:15.5px}
.results li{margin:2px 0}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(122px,1fr));gap:10px;margin-top:18px}
.tile{border:1px solid var(--line);border-radius:9px;padding:10px 13px}
.tile b{display:block;font-size:21px;font-weight:600;line-height:1.25;font-variant-numeric:tabular-nums}
.tile span{color:var(--soft);font-size:12.5px}
.lead{color:var(--soft);margin:0 0 14px;max-width:82ch}
.legend{display:flex;flex-wrap:wrap;gap:4px 20px;margin:8px 0 0;color:var(--soft);font-size:13px}
.legend i{display:inline-block;width:14px;height:10px;margin-right:7px;border-radius:2px;vertical-align:baseline}
svg{display:block;width:100%;height:auto;overflow:visible}
svg text{font:12px system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;fill:var(--soft)}
svg text.ink{fill:var(--ink)}
svg text.b{font-weight:600}
svg text.s{font-size:11px}
svg text.e{text-anchor:end}
svg text.m{text-anchor:middle}
svg text.halo{paint-order:stroke;stroke:var(--card);stroke-width:4px;stroke-linejoin:round}
.grid{stroke:var(--grid)}
.axis{stroke:var(--line)}
.two{display:grid;grid-template-columns:minmax(0,1fr);gap:18px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;font-size:14px}
th{font-weight:600;color:var(--soft);font-size:12.5px;text-align:left;padding:6px 12px 6px 0;
  border-bottom:1px solid var(--line); white-space:nowrap;vertical-align:bottom}
td{padding:6px 12px 6px 0;border-bottom:1px solid var(--grid);vertical-align:top}
th.n,td.n{text-align:right;padding:6px 0 6px 14px;white-space:nowrap}
tr:last-child td{border-bottom:0}
.chip{display:inline-block;border-radius:99px;padding:1px 10px;font-size:12.5px;font-weight:600;
  border:1px solid currentColor}
.chip.good{color:var(--good)}
.chip.bad{color:var(--bad)}
.chip.idle{color:var(--soft)}
.chip.warn{color:var(--warn)}
ol.chain{list-style:none;margin:0;padding:0;counter-reset:c}
ol.chain li{position:relative;padding:0 0 16px 34px;counter-increment:c}
ol.chain li::before{content:counter(c);position:absolute;left:0;top:1px;width:22px;height:22px;border-radius:50%;
  background:var(--grid);font-size:12px;font-weight:600;display:grid;place-items:center}
ol.chain li:not(:last-child)::after{content:"";position:absolute;left:10.5px;top:26px;bottom:2px;width:1px;
  background:var(--line)}
ol.chain code{font-size:13px}
ol.chain p{margin:2px 0 0;color:var(--soft)}
code{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace;font-size:13px}
.sets{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,460px),1fr));gap:6px 30px}
.seq{margin:0 0 12px}
.seq>.tag{color:var(--soft);font-size:12.5px;margin:0 0 4px}
.layers{display:flex;flex-wrap:wrap;gap:12px}
figure{margin:0}
figure .pads{display:flex;gap:3px}
figure img{width:50px;height:87px;image-rendering:pixelated;border-radius:3px;background:var(--grid);display:block}
figcaption{font-size:11.5px;line-height:1.35;color:var(--soft);margin-top:4px;font-variant-numeric:tabular-nums}
figcaption b{color:var(--ink);font-weight:600}
figure.off{opacity:.55}
.film{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,230px),1fr));gap:12px}
.film img{width:100%;height:auto;image-rendering:auto;border-radius:7px}
.bar{height:10px;border-radius:5px;width:220px;display:inline-block;vertical-align:middle;margin:0 8px}
.sparks{display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:10px 14px;margin-top:10px}
.sparks figcaption{margin-top:0}
details{margin-top:16px}
summary{cursor:pointer;color:var(--soft);font-size:13.5px}
.k-force{background:var(--blue)}
.k-contact{background:var(--contact);border-radius:50%!important;width:10px!important}
.k-path{background:var(--path);height:2px!important;vertical-align:middle!important}
.k-fit{border:2px solid var(--blue);background:var(--wash)}
.k-truth{border:2px dashed var(--truth)}
.k-moved{border:2px dotted var(--truth)}
.k-jaw{background:var(--t1);height:4px!important;vertical-align:middle!important}
.k-good{background:var(--good)}
.k-bad{background:var(--bad)}
.k-warn{background:var(--warn)}
.k-idle{background:var(--idle)}
.k-t0{background:var(--t0)}
.k-t1{background:var(--t1)}
.k-t2{background:var(--t2)}
.k-t3{background:var(--t3)}
.k-t4{background:var(--t4)}
.k-t5{background:var(--t5)}
.tree{font-size:13.5px;line-height:1.3}
.tree details{margin:0}
.tree summary,.leaf{display:grid;grid-template-columns:minmax(0,1.35fr) minmax(0,1fr);gap:12px;align-items:center;
  padding:2px 0;border-bottom:1px solid var(--grid);color:inherit;font-size:inherit;list-style:none}
.tree svg{height:10px;background:var(--grid);border-radius:2px}
.node{padding-left:calc(min(14px,1.6vw)*var(--d));overflow-wrap:anywhere}
.node b{display:inline-block;width:1.2em}
.node small{color:var(--soft)}
summary .node>span::after{content:" ▸";color:var(--soft)}
details[open]>summary>.node>span::after{content:" ▾"}
.node.good b{color:var(--good)}
.node.bad{color:var(--bad)}
.node.warn b{color:var(--warn)}
.node.idle{color:var(--idle)}
.stage{position:relative;border-radius:10px;overflow:hidden;background:linear-gradient(#dfe7f0,#f7f8fa)}
#scene{display:block;width:100%;height:min(62vh,560px);touch-action:pan-y;cursor:grab}
#scene-names{position:absolute;inset:0;pointer-events:none;overflow:hidden}
#scene-names span{position:absolute;transform:translate(-50%,-100%);background:#ffffffd9;color:#14181f;font-size:12px;
  font-weight:600;border-radius:5px;padding:0 6px;white-space:nowrap}
.over-scene{position:absolute;left:12px;top:8px;color:#14181f;font-variant-numeric:tabular-nums}
.over-scene b{color:#14181f;font-size:17px;margin-right:10px}
.no-gl{display:none;position:absolute;inset:0;margin:0;place-items:center;color:#5a6472}
#scene-box.none .no-gl{display:grid}
.strip{height:44px;margin:8px 0 0}
.play{display:flex;gap:12px;align-items:end}
.play div{flex:1;min-width:0}
.play input{width:100%;margin:0}
.play button,.play select,.boxes select{font:inherit;font-size:13.5px;padding:3px 10px;border-radius:7px;
  border:1px solid var(--line);background:var(--card);color:var(--ink)}
.boxes{display:flex;flex-wrap:wrap;gap:6px 18px;margin-top:8px;color:var(--soft);font-size:13.5px}
footer{color:var(--soft);font-size:12.5px;padding:4px 6px}
@media(max-width:640px){
  main{padding:10px 8px 30px}
  header,section{padding:16px 14px}
  h1{font-size:22px}
  .facts span{margin-right:12px;white-space:normal}
  .wide{overflow-x:auto}
  .wide>svg{min-width:680px}
  .sparks .wide>svg{min-width:0}
  svg text{font-size:14px}
  .tiles{grid-template-columns:repeat(2,minmax(0,1fr))}
  #scene{height:78vw}
  .play{gap:8px}
}
@media print{body{background:#fff}section,header{break-inside:avoid;border-color:#ccc}}
"""
