// Each slider moves the border between original and level in its own section.
for (const slider of document.querySelectorAll('.slider input')) {
  const section = slider.closest('section');
  const show = () => {
    section.style.setProperty('--at', `${slider.value}%`);
    slider.setAttribute('aria-valuetext', `original on the left ${slider.value} percent`);
  };
  slider.addEventListener('input', show);
  show();
}
