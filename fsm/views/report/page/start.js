if (at("data").dataset.live) startLive(); else startPage(JSON.parse(at("data").textContent));
