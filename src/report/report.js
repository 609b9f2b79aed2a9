"use strict";
{
    const at = id => document.getElementById(id);
    const sources = [...document.querySelectorAll(".source")];
    const [left, right, split, stage] = ["left", "right", "split", "stage"].map(at);
    const name = select => sources[select.value].querySelector("figcaption").textContent;
    const show = () => {
        for (const [select, image, tag] of [[left, "above", "left-tag"], [right, "below", "right-tag"]]) {
            at(image).src = sources[select.value].querySelector("img").src;
            at(tag).textContent = name(select);
        }
        at("above").style.clipPath = `inset(0 ${100 - split.value}% 0 0)`;
        at("edge").style.left = split.value + "%";
        at("left-tag").hidden = split.value < 1;
        at("right-tag").hidden = split.value > 99;
        split.setAttribute("aria-valuetext", `${split.value} % ${name(left)}, the rest ${name(right)}`);
    };
    const flip = () => {
        split.value = split.value > 50 ? 0 : 100;
        show();
    };
    const drag = event => {
        if (event.buttons !== 1) return;
        const box = stage.getBoundingClientRect();
        split.value = 100 * (event.clientX - box.left) / box.width;
        show();
    };
    for (const input of [left, right, split]) input.addEventListener("input", show);
    for (const kind of ["pointerdown", "pointermove"]) stage.addEventListener(kind, drag);
    at("flip").addEventListener("click", flip);
    at("frames").addEventListener("input", () => stage.classList.toggle("bare", !at("frames").checked));
    document.addEventListener("keydown", event => {
        const typing = event.target.matches("select, input:not([type=range])");
        if (event.key.toLowerCase() === "f" && !typing && !event.ctrlKey && !event.metaKey && !event.altKey) flip();
    });
    at("viewer").hidden = false;
    show();
}
