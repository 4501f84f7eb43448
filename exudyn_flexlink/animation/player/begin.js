// Begin: the program stands in the player's own element, beside the data.

const root = document.currentScript.closest(".flexlink-player");
const data = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
root.flexlinkPlayer = new Player(root, data); // for programs of the page: play(), pause(), go(t)
