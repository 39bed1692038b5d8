"""Between the topics of the contract and the data of the mathematics."""
