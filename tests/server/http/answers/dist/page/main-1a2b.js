document.title = "it moves";
