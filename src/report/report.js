"use strict";
{
    const at = id => document.getElementById(id);
    const sources = document.querySelectorAll(".source img");
    const show = () => {
        at("above").src = sources[at("left").value].src;
        at("below").src = sources[at("right").value].src;
        at("above").style.clipPath = `inset(0 ${100 - at("split").value}% 0 0)`;
    };
    for (const id of ["left", "right", "split"])
        at(id).addEventListener("input", show);
    at("flip").addEventListener("click", () => {
        at("split").value = at("split").value > 50 ? 0 : 100;
        show();
    });
    show();
}
