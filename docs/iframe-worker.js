/* Search in pages that are opened as files. Browsers refuse `new Worker(...)` there, so the script of the worker runs in a hidden frame. */
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      this.ready = new Promise((done) => {
        window.__workers = window.__workers || [];
        const number = window.__workers.push((inside) => done(inside)) - 1;
        const tell = (data) => {
          const event = new MessageEvent("message", { data });
          this.dispatchEvent(event);
          if (this.onmessage) this.onmessage(event);
        };
        window.__workers[number].tell = tell;
        frame.srcdoc =
          "<script>var postMessage = function (d) { parent.__workers[" + number + "].tell(d); };" +
          "var importScripts = function () { return Promise.resolve(); };</" + "script>" +
          '<script src="' + url + '"></' + "script>" +
          "<script>parent.__workers[" + number + "](window);</" + "script>";
      });
      document.body.appendChild(frame);
      this.frame = frame;
    }
    postMessage(data) {
      this.ready.then((inside) => inside.dispatchEvent(new inside.MessageEvent("message", { data })));
    }
    terminate() {
      this.frame.remove();
    }
  };
}
